#include "server/http/endpoints/device_documents.hpp"

#include <algorithm>
#include <set>

#include "core/session/url.hpp"
#include "node/generate/definition_set.hpp"
#include "node/generate/generate_typescript.hpp"
#include "server/http/endpoints/image_values.hpp"
#include "server/http/endpoints/member_values.hpp"
#include "server/http/etag.hpp"
#include "server/json/schema.hpp"

namespace rrgate {

using rr::add_key;
using rr::OrderedJson;

namespace {

/// A member and the URL path that leads to it.
struct Place {
  const DescribedService* service;
  const rr::MemberDefinition* member;
  std::string path;         ///< "/api/v1/devices/d/Create/axes/{axes}/position"
  std::string object_path;  ///< "Create.axes[{axes}]"
  std::vector<std::string> indices;
  std::string id;  ///< "Create_axes_position"
};

bool has_index(const rr::MemberDefinition& objref) {
  return objref.type.array != rr::ArrayKind::none || objref.type.container != rr::ContainerKind::none;
}

/// Every member that a path leads to. An object type within itself is listed once; what is behind a varobject is known
/// at run time only.
void add_places(const DescribedService& service, const rr::EntityDefinition& type, const Place& object,
                std::vector<std::string> chain, std::vector<Place>& out) {
  chain.push_back(type.qualified_name);
  for (const auto& member : type.members) {
    Place place = object;
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

std::vector<Place> places_of(const std::string& base, const std::vector<DescribedService>& services) {
  std::vector<Place> out;
  for (const auto& service : services) {
    const auto* root = service.types->find_entity(service.root_type);
    if (!root) continue;
    const Place object{&service,     nullptr, base + "/" + rr::percent_encode(service.name),
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

/// The documents say what they are about as every device of its kind does.
void add_info(OrderedJson& out, std::string_view device) {
  out["info"] = {{"title", std::string(device)},
                 {"version", "1"},
                 {"description", "Objects of a Robot Raconteur node, told from its service definitions."}};
}

bool can_read(const rr::MemberDefinition& member) {
  return member.direction() != rr::MemberDirection::writeonly;
}
bool can_write(const rr::MemberDefinition& member) {
  return member.direction() != rr::MemberDirection::readonly;
}
bool takes_values_while_running(const rr::MemberDefinition& member) {
  return !member.parameters.empty() && member.parameters.back().type.container == rr::ContainerKind::generator;
}

// --- OpenAPI 3.1 ---

OrderedJson json_content(OrderedJson schema) {
  return {{"application/json", {{"schema", std::move(schema)}}}};
}

class OpenApi {
 public:
  OrderedJson write(std::string_view device, const std::vector<Place>& places, OrderedJson schemas,
                    const std::vector<std::string>& unavailable) {
    OrderedJson out{{"openapi", "3.1.0"}};
    add_info(out, device);
    if (!unavailable.empty()) out["x-rr-unavailable"] = unavailable;
    auto& paths = out["paths"] = OrderedJson::object();
    for (const auto& place : places) add_place(place, paths);
    const OrderedJson error{{"type", "object"},
                            {"properties",
                             {{"type", {{"type", "string"}}},
                              {"title", {{"type", "string"}}},
                              {"status", {{"type", "integer"}}},
                              {"detail", {{"type", "string"}}},
                              {"error",
                               {{"type", "object"},
                                {"properties", {{"name", {{"type", "string"}}}, {"message", {{"type", "string"}}}}},
                                {"required", {"name", "message"}}}}}},
                            {"required", {"title", "status", "detail"}}};
    out["components"] = {
        {"schemas", std::move(schemas)},
        {"responses",
         {{"Problem",
           {{"description", "What went wrong: RFC 9457, with the Robot Raconteur error."},
            {"content", {{"application/problem+json", {{"schema", error}}}}}}}}},
        {"securitySchemes",
         {{"device", {{"type", "http"}, {"scheme", "basic"}, {"description", "The device's own users."}}}}}};
    return out;
  }

 private:
  static OrderedJson operation(const Place& place, std::string_view verb, OrderedJson responses) {
    OrderedJson out{{"operationId", std::string(verb) + "_" + place.id}, {"tags", {place.service->name}}};
    if (!place.member->documentation.empty()) out["description"] = plain_documentation(place.member->documentation);
    responses["default"] = {{"$ref", "#/components/responses/Problem"}};
    out["responses"] = std::move(responses);
    return out;
  }
  static OrderedJson with_content(std::string_view description, OrderedJson content) {
    return {{"200", {{"description", std::string(description)}, {"content", std::move(content)}}}};
  }
  static OrderedJson written() { return {{"204", {{"description", "done"}}}}; }
  static OrderedJson body(OrderedJson schema) {
    return {{"required", true}, {"content", json_content(std::move(schema))}};
  }
  static OrderedJson events(OrderedJson schema) {
    return {{"text/event-stream", {{"schema", {{"type", "string"}}}, {"x-rr-data", std::move(schema)}}}};
  }

  /// What a value is also given as.
  static void add_images(const Place& place, OrderedJson& content, bool is_stream) {
    if (!is_image_type(place.member->type, *place.service->types)) return;
    const OrderedJson binary{{"schema", {{"type", "string"}, {"contentEncoding", "binary"}}}};
    for (const auto& type : is_stream ? std::vector<std::string>{"multipart/x-mixed-replace"}
                                      : std::vector<std::string>{std::string(png_type), std::string(jpeg_type)})
      content[type] = binary;
  }

  static void add_place(const Place& place, OrderedJson& paths) {
    const auto& member = *place.member;
    OrderedJson item = OrderedJson::object();
    for (const auto& index : place.indices)
      item["parameters"].push_back(
          {{"name", index}, {"in", "path"}, {"required", true}, {"schema", {{"type", "string"}, {"minLength", 1}}}});
    const auto schema = rr::type_schema(member.type);
    switch (member.kind) {
      case rr::MemberKind::property:
        if (can_read(member)) {
          auto content = json_content(schema);
          add_images(place, content, false);
          item["get"] = operation(place, "get", with_content("the value", std::move(content)));
        }
        if (can_write(member)) {
          item["put"] = operation(place, "set", written());
          item["put"]["requestBody"] = body(schema);
        }
        break;
      case rr::MemberKind::function:
        item["post"] = function_operation(place, schema);
        break;
      case rr::MemberKind::wire:
        if (can_read(member)) {
          auto content = json_content(schema);
          content.update(events(schema));
          add_images(place, content, false);
          add_images(place, content, true);
          item["get"] = operation(place, "get", with_content("the newest value, or each as it comes", content));
        }
        if (can_write(member)) {
          item["put"] = operation(place, "set", written());
          item["put"]["requestBody"] = body(schema);
        }
        break;
      case rr::MemberKind::pipe:
        if (can_read(member)) {
          auto content = events(schema);
          add_images(place, content, true);
          item["get"] = operation(place, "stream", with_content("each packet", std::move(content)));
        }
        break;
      case rr::MemberKind::event:
        item["get"] =
            operation(place, "stream", with_content("each event", events(arguments_schema(member.parameters))));
        break;
      case rr::MemberKind::memory:
        add_memory(place, schema, item, paths);
        break;
      default:
        return;  // callbacks ask the client
    }
    add_key(paths, place.path) = std::move(item);
  }

  static OrderedJson function_operation(const Place& place, const OrderedJson& schema) {
    const auto& member = *place.member;
    OrderedJson content;
    if (member.is_generator())
      content = {{"application/x-ndjson", {{"schema", {{"type", "string"}}}, {"x-rr-line", schema}}}};
    else
      content = json_content({{"type", "object"}, {"properties", {{"result", schema}}}, {"required", {"result"}}});
    if (!member.is_generator()) add_images(place, content, false);
    auto out = operation(place, "call", with_content("the result", std::move(content)));
    if (takes_values_while_running(member)) out["deprecated"] = true;  // its parameter stream needs a WebSocket
    if (!member.parameters.empty()) out["requestBody"] = body(arguments_schema(member.parameters));
    return out;
  }

  static void add_memory(const Place& place, const OrderedJson& schema, OrderedJson& item, OrderedJson& paths) {
    const auto numbers = [](const char* name, const char* what) {
      return OrderedJson{{"name", name},
                         {"in", "query"},
                         {"description", what},
                         {"schema", {{"type", "string"}, {"pattern", "^[0-9]+(,[0-9]+)*$"}}}};
    };
    const auto offset = numbers("offset", "first item, one number a dimension");
    if (can_read(*place.member)) {
      auto content = json_content(schema);
      content["application/octet-stream"] = OrderedJson::object();
      item["get"] = operation(place, "read", with_content("items", std::move(content)));
      item["get"]["responses"]["206"] = {{"description", "the bytes that Range asked for"}};
      item["get"]["parameters"] = {offset, numbers("count", "how many, one number a dimension")};
    }
    if (can_write(*place.member)) {
      item["put"] = operation(place, "write", written());
      item["put"]["parameters"] = OrderedJson::array({offset});
      item["put"]["requestBody"] = body(schema);
    }
    OrderedJson shape;
    if (item.contains("parameters")) shape["parameters"] = item["parameters"];
    const OrderedJson sizes{{"type", "array"}, {"items", {{"type", "integer"}}}};
    shape["get"] = operation(place, "shape", with_content("items a dimension", json_content(sizes)));
    add_key(paths, place.path + "/shape") = std::move(shape);
  }
};

// --- AsyncAPI 3.0: what comes as server-sent events, and the WebSocket of each service ---

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
    const auto id = "socket_" + service.name;
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

OrderedJson async_api(std::string_view device, const std::string& base, const std::vector<DescribedService>& services,
                      const std::vector<Place>& places, OrderedJson schemas) {
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
    auto payload = is_event ? arguments_schema(member.parameters) : rr::type_schema(member.type);
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

// --- Web of Things: Thing Description 1.1 ---

OrderedJson form(const Place& place, std::string_view op, std::string_view method, std::string_view subprotocol = {}) {
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

OrderedJson thing_description(std::string_view device, const std::vector<Place>& places, OrderedJson schemas) {
  OrderedJson out{{"@context", "https://www.w3.org/2022/wot/td/v1.1"}, {"title", std::string(device)}};
  out["securityDefinitions"] = {{"nosec_sc", {{"scheme", "nosec"}}}, {"device", {{"scheme", "basic"}}}};
  out["security"] = "nosec_sc";
  out["schemaDefinitions"] = std::move(schemas);
  auto properties = OrderedJson::object();
  auto actions = OrderedJson::object();
  auto events = OrderedJson::object();
  const auto with_variables = [](OrderedJson affordance, const Place& place) {
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
    } else if (member.kind == rr::MemberKind::function && !takes_values_while_running(member)) {
      OrderedJson item{{"input", arguments_schema(member.parameters)}, {"output", rr::type_schema(member.type)}};
      item["forms"] = OrderedJson::array({form(place, "invokeaction", "POST")});
      add_key(actions, place.id) = with_variables(std::move(item), place);
    } else if (member.kind == rr::MemberKind::event || (member.kind == rr::MemberKind::pipe && can_read(member))) {
      const bool is_event = member.kind == rr::MemberKind::event;
      OrderedJson item{{"data", is_event ? arguments_schema(member.parameters) : rr::type_schema(member.type)}};
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

std::string typescript(const std::vector<DescribedService>& services) {
  std::vector<std::string> texts;
  std::set<std::string> names;
  for (const auto& service : services)
    for (const auto& definition : service.types->definitions())
      if (names.insert(definition->name).second) texts.push_back(definition->text);
  const auto set = DefinitionSet::from_texts(texts, rr::RobdefMode::compat);
  return generate_typescript(set, TypeScriptFlavour::declarations);
}

}  // namespace

Response device_document(std::string_view document, std::string_view device, const std::string& base,
                         const std::vector<DescribedService>& services, const std::vector<std::string>& unavailable) {
  if (document == "types.d.ts")
    return text_response(200, "application/typescript; charset=utf-8", typescript(services));
  const auto places = places_of(base, services);
  auto schemas = schemas_of(services);
  OrderedJson out;
  std::string_view type = "application/json";
  if (document == "openapi.json") {
    out = OpenApi().write(device, places, std::move(schemas), unavailable);
  } else if (document == "asyncapi.json") {
    out = async_api(device, base, services, places, std::move(schemas));
  } else {
    out = thing_description(device, places, std::move(schemas));
    type = "application/td+json";
  }
  return text_response(200, type, out.dump(-1, ' ', false, OrderedJson::error_handler_t::replace) + "\n");
}

Response with_etag(Response response, const Request& request) {
  const auto etag = make_etag(*response.body);
  response.set("ETag", etag).set("Cache-Control", "no-cache");
  if (!has_token(request.header(http::field::if_none_match), etag)) return response;
  response.status = 304;
  response.body = nullptr;
  return response;
}

}  // namespace rrgate
