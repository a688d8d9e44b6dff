// A device as an OpenAPI 3.1 document. Layer: server/http/endpoints.
#include "server/http/endpoints/device_places.hpp"
#include "server/http/endpoints/image_values.hpp"
#include "server/http/endpoints/member_values.hpp"
#include "server/json/schema.hpp"

namespace rrgate {

using rr::add_key;
using rr::OrderedJson;

namespace {

OrderedJson json_content(OrderedJson schema) {
  return {{"application/json", {{"schema", std::move(schema)}}}};
}

class OpenApi {
 public:
  OrderedJson write(std::string_view device, const std::vector<DocumentedMember>& places, OrderedJson schemas,
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
  static OrderedJson operation(const DocumentedMember& place, std::string_view verb, OrderedJson responses) {
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
  static void add_images(const DocumentedMember& place, OrderedJson& content, bool is_stream) {
    if (!is_image_type(place.member->type, *place.service->types)) return;
    const OrderedJson binary{{"schema", {{"type", "string"}, {"contentEncoding", "binary"}}}};
    for (const auto& type : is_stream ? std::vector<std::string>{"multipart/x-mixed-replace"}
                                      : std::vector<std::string>{std::string(png_type), std::string(jpeg_type)})
      content[type] = binary;
  }

  static void add_place(const DocumentedMember& place, OrderedJson& paths) {
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
        item["get"] = operation(place, "stream", with_content("each event", events(rr::arguments_schema(member))));
        break;
      case rr::MemberKind::memory:
        add_memory(place, schema, item, paths);
        break;
      default:
        return;  // callbacks ask the client
    }
    add_key(paths, place.path) = std::move(item);
  }

  static OrderedJson function_operation(const DocumentedMember& place, const OrderedJson& schema) {
    const auto& member = *place.member;
    OrderedJson content;
    if (member.is_generator())
      content = {{"application/x-ndjson", {{"schema", {{"type", "string"}}}, {"x-rr-line", schema}}}};
    else
      content = json_content({{"type", "object"}, {"properties", {{"result", schema}}}, {"required", {"result"}}});
    if (!member.is_generator()) add_images(place, content, false);
    auto out = operation(place, "call", with_content("the result", std::move(content)));
    if (member.step_parameter()) out["deprecated"] = true;  // its parameter stream needs a WebSocket
    if (!member.parameters.empty()) out["requestBody"] = body(rr::arguments_schema(member));
    return out;
  }

  static void add_memory(const DocumentedMember& place, const OrderedJson& schema, OrderedJson& item,
                         OrderedJson& paths) {
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

}  // namespace

OrderedJson open_api(std::string_view device, const std::vector<DocumentedMember>& places, OrderedJson schemas,
                     const std::vector<std::string>& unavailable) {
  return OpenApi().write(device, places, std::move(schemas), unavailable);
}

}  // namespace rrgate
