// A device as a Thing Description 1.1 of the Web of Things. Layer: server/http/endpoints.
#include "server/http/endpoints/device_places.hpp"
#include "server/http/endpoints/member_values.hpp"
#include "server/json/schema.hpp"

namespace rrgate {

using rr::add_key;
using rr::OrderedJson;

namespace {

OrderedJson form(const DocumentedMember& place, std::string_view op, std::string_view method,
                 std::string_view subprotocol = {}) {
  OrderedJson out{{"href", place.path}, {"op", std::string(op)}, {"htv:methodName", std::string(method)}};
  if (!subprotocol.empty()) {
    out["subprotocol"] = std::string(subprotocol);
    out["contentType"] = "text/event-stream";
  }
  return out;
}

/// A Thing Description has named types elsewhere than OpenAPI, for which type_schema() refers to them.
void lead_to_schema_definitions(OrderedJson& value) {
  constexpr std::string_view there = "#/components/schemas/";
  if (value.is_object() && value.contains("$ref")) {
    const auto reference = value["$ref"].get<std::string>();
    if (reference.starts_with(there)) value["$ref"] = "#/schemaDefinitions/" + reference.substr(there.size());
  } else if (value.is_structured()) {
    for (auto& part : value) lead_to_schema_definitions(part);
  }
}

}  // namespace

OrderedJson thing_description(std::string_view device, const std::vector<DocumentedMember>& places,
                              OrderedJson schemas) {
  OrderedJson out{{"@context", "https://www.w3.org/2022/wot/td/v1.1"}, {"title", std::string(device)}};
  out["securityDefinitions"] = {{"nosec_sc", {{"scheme", "nosec"}}}, {"device", {{"scheme", "basic"}}}};
  out["security"] = "nosec_sc";
  out["schemaDefinitions"] = std::move(schemas);
  auto properties = OrderedJson::object();
  auto actions = OrderedJson::object();
  auto events = OrderedJson::object();
  const auto with_variables = [](OrderedJson affordance, const DocumentedMember& place) {
    for (const auto& index : place.indices) affordance["uriVariables"][index] = {{"type", "string"}};
    if (!place.member->documentation.empty())
      affordance["description"] = plain_documentation(place.member->documentation);
    return affordance;
  };
  for (const auto& place : places) {
    const auto& member = *place.member;
    if (member.kind == rr::MemberKind::property || member.kind == rr::MemberKind::wire) {
      auto item = rr::type_schema(member.type);
      item["readOnly"] = !can_write(member);
      item["writeOnly"] = !can_read(member);
      auto forms = OrderedJson::array();
      if (can_read(member)) forms.push_back(form(place, "readproperty", "GET"));
      if (can_write(member)) forms.push_back(form(place, "writeproperty", "PUT"));
      if (can_read(member) && member.kind == rr::MemberKind::wire) {
        item["observable"] = true;
        forms.push_back(form(place, "observeproperty", "GET", "sse"));
      }
      item["forms"] = std::move(forms);
      add_key(properties, place.id) = with_variables(std::move(item), place);
    } else if (member.kind == rr::MemberKind::function && !member.step_parameter()) {
      OrderedJson item{{"input", rr::arguments_schema(member)}, {"output", rr::type_schema(member.type)}};
      item["forms"] = OrderedJson::array({form(place, "invokeaction", "POST")});
      add_key(actions, place.id) = with_variables(std::move(item), place);
    } else if (member.kind == rr::MemberKind::event || (member.kind == rr::MemberKind::pipe && can_read(member))) {
      const bool is_event = member.kind == rr::MemberKind::event;
      OrderedJson item{{"data", is_event ? rr::arguments_schema(member) : rr::type_schema(member.type)}};
      item["forms"] = OrderedJson::array({form(place, "subscribeevent", "GET", "sse")});
      add_key(events, place.id) = with_variables(std::move(item), place);
    }
  }
  out["properties"] = std::move(properties);
  out["actions"] = std::move(actions);
  out["events"] = std::move(events);
  lead_to_schema_definitions(out);
  return out;
}

}  // namespace rrgate
