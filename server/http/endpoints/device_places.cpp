#include "server/http/endpoints/device_places.hpp"

#include <algorithm>

#include "core/session/url.hpp"
#include "server/json/schema.hpp"

namespace rrgate {

using rr::add_key;
using rr::OrderedJson;

namespace {

bool has_index(const rr::MemberDefinition& objref) {
  return objref.type.array != rr::ArrayKind::none || objref.type.container != rr::ContainerKind::none;
}

void add_places(const DescribedService& service, const rr::EntityDefinition& type, const DocumentedMember& object,
                std::vector<std::string> chain, std::vector<DocumentedMember>& out) {
  chain.push_back(type.qualified_name);
  for (const auto& member : type.members) {
    DocumentedMember place = object;
    place.member = &member;
    place.path += "/" + member.name;
    place.id += "_" + member.name;
    if (member.kind != rr::MemberKind::objref) {
      out.push_back(std::move(place));
      continue;
    }
    const auto* target = service.types->find_entity(member.type.qualified_name);
    if (!target || std::find(chain.begin(), chain.end(), target->qualified_name) != chain.end()) continue;
    place.object_path += "." + member.name;
    if (has_index(member)) {
      auto name = member.name;
      while (std::find(place.indices.begin(), place.indices.end(), name) != place.indices.end()) name += "_";
      place.path += "/{" + name + "}";
      place.object_path += "[{" + name + "}]";
      place.indices.push_back(name);
    }
    add_places(service, *target, place, chain, out);
  }
}

}  // namespace

std::vector<DocumentedMember> places_of(const std::string& base, const std::vector<DescribedService>& services) {
  std::vector<DocumentedMember> out;
  for (const auto& service : services) {
    const auto* root = service.types->find_entity(service.root_type);
    if (!root) continue;
    const DocumentedMember object{&service,     nullptr, base + "/" + rr::percent_encode(service.name),
                                  service.name, {},      service.name};
    add_places(service, *root, object, {}, out);
  }
  return out;
}

OrderedJson schemas_of(const std::vector<DescribedService>& services) {
  auto out = OrderedJson::object();
  for (const auto& service : services) {
    auto schemas = rr::named_type_schemas(*service.types);
    for (auto& [name, schema] : schemas.items())
      if (!out.contains(name)) add_key(out, name) = std::move(schema);
  }
  return out;
}

OrderedJson arguments_schema(const std::vector<rr::ParameterDefinition>& parameters) {
  OrderedJson out{{"type", "object"}};
  auto& properties = out["properties"] = OrderedJson::object();
  auto required = OrderedJson::array();
  for (const auto& parameter : parameters) {
    if (parameter.type.container == rr::ContainerKind::generator) continue;
    add_key(properties, parameter.name) = rr::type_schema(parameter.type);
    required.push_back(parameter.name);
  }
  if (!required.empty()) out["required"] = std::move(required);
  out["additionalProperties"] = false;
  return out;
}

void add_info(OrderedJson& out, std::string_view device) {
  out["info"] = {{"title", std::string(device)},
                 {"version", "1"},
                 {"description", "Objects of a Robot Raconteur node, told from its service definitions."}};
}

bool takes_values_while_running(const rr::MemberDefinition& member) {
  return !member.parameters.empty() && member.parameters.back().type.container == rr::ContainerKind::generator;
}

}  // namespace rrgate
