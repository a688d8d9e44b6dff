// A device as an AsyncAPI 3.0 document: what comes as server-sent events, and the WebSocket of each service. Layer:
// server/http/endpoints.
#include "core/session/url.hpp"
#include "server/http/endpoints/device_places.hpp"
#include "server/http/endpoints/member_values.hpp"
#include "server/json/schema.hpp"

namespace rrgate {

using rr::add_key;
using rr::OrderedJson;

namespace {

/// What goes over the WebSocket of a service, either way.
OrderedJson socket_messages() {
  const OrderedJson id{{"type", {"integer", "string"}}};
  const OrderedJson text{{"type", "string"}};
  const OrderedJson any_object{{"type", "object"}};
  const auto object = [](OrderedJson properties, OrderedJson required) {
    return OrderedJson{
        {"payload", {{"type", "object"}, {"properties", std::move(properties)}, {"required", std::move(required)}}}};
  };
  const auto names = OrderedJson::array({"describe", "get", "set", "call", "open", "next", "close", "abort",
                                         "subscribe", "unsubscribe", "send", "callback", "answer", "shape", "read",
                                         "write", "lock", "unlock", "login"});
  OrderedJson out;
  out["request"] = object({{"id", id},
                           {"op", {{"enum", names}}},
                           {"path", text},
                           {"value", OrderedJson::object()},
                           {"args", any_object},
                           {"generator", id},
                           {"subscription", id},
                           {"call", {{"type", "integer"}}},
                           {"after", {{"type", "integer"}}}},
                          OrderedJson::array({"op"}));
  const OrderedJson error{
      {"type", "object"}, {"properties", {{"name", text}, {"message", text}}}, {"required", {"name", "message"}}};
  out["answer"] =
      object({{"id", {{"type", {"integer", "string", "null"}}}}, {"result", OrderedJson::object()}, {"error", error}},
             OrderedJson::array({"id"}));
  const OrderedJson states{{"enum", {"connection_lost", "connected", "closed"}}};
  out["news"] = object({{"subscription", id},
                        {"value", OrderedJson::object()},
                        {"number", {{"type", "integer"}}},
                        {"time", any_object},
                        {"state", states},
                        {"detail", text},
                        {"error", error}},
                       OrderedJson::array({"subscription"}));
  out["question"] = object({{"callback", id}, {"call", {{"type", "integer"}}}, {"args", any_object}},
                           OrderedJson::array({"callback", "call", "args"}));
  return out;
}

void add_sockets(const std::string& base, const std::vector<DescribedService>& services, OrderedJson& channels,
                 OrderedJson& operations) {
  for (const auto& service : services) {
    const auto id = socket_id(service);
    add_key(channels, id) = {
        {"address", base + "/" + rr::percent_encode(service.name)},
        {"description", "JSON messages over a WebSocket, subprotocol rrgate.json.v1; also at objects below."},
        {"bindings", {{"ws", {{"method", "GET"}}}}},
        {"messages", socket_messages()}};
    const auto reference = [&](std::string_view message) {
      return OrderedJson{{"$ref", "#/channels/" + id + "/messages/" + std::string(message)}};
    };
    const OrderedJson channel{{"$ref", "#/channels/" + id}};
    add_key(operations, "send_" + id) = {
        {"action", "send"}, {"channel", channel}, {"messages", OrderedJson::array({reference("request")})}};
    add_key(operations, "receive_" + id) = {
        {"action", "receive"},
        {"channel", channel},
        {"messages", OrderedJson::array({reference("answer"), reference("news"), reference("question")})}};
  }
}

}  // namespace

OrderedJson async_api(std::string_view device, const std::string& base, const std::vector<DescribedService>& services,
                      const std::vector<DocumentedMember>& places, OrderedJson schemas) {
  OrderedJson out{{"asyncapi", "3.0.0"}};
  add_info(out, device);
  out["defaultContentType"] = "application/json";
  auto channels = OrderedJson::object();
  auto operations = OrderedJson::object();
  add_sockets(base, services, channels, operations);
  for (const auto& place : places) {
    const auto& member = *place.member;
    const bool is_event = member.kind == rr::MemberKind::event;
    const bool streams =
        is_event || ((member.kind == rr::MemberKind::wire || member.kind == rr::MemberKind::pipe) && can_read(member));
    if (!streams) continue;
    auto payload = is_event ? rr::arguments_schema(member) : rr::type_schema(member.type);
    auto& channel = add_key(channels, place.id) = OrderedJson{{"address", place.path}};
    for (const auto& index : place.indices) channel["parameters"][index] = OrderedJson::object();
    channel["messages"]["value"]["payload"] = std::move(payload);
    if (!member.documentation.empty()) channel["description"] = plain_documentation(member.documentation);
    add_key(operations, "receive_" + place.id) = {{"action", "receive"},
                                                  {"channel", {{"$ref", "#/channels/" + place.id}}}};
  }
  out["channels"] = std::move(channels);
  out["operations"] = std::move(operations);
  out["components"]["schemas"] = std::move(schemas);
  return out;
}

}  // namespace rrgate
