#include "server/http/endpoints/object_request.hpp"

#include <algorithm>

#include "core/session/service_path.hpp"
#include "core/types/value_size.hpp"
#include "node/values/exception.hpp"
#include "server/access/authorization.hpp"
#include "server/http/endpoints/image_values.hpp"
#include "server/http/endpoints/large_json.hpp"
#include "server/http/endpoints/member_values.hpp"
#include "server/state/http_access.hpp"

namespace rrgate {

namespace {

/// What is named goes before what "image/*" takes, and PNG before JPEG; empty: neither is taken.
std::string_view accepted_image(std::string_view accept) {
  const auto png = acceptance(accept, png_type);
  const auto jpeg = acceptance(accept, jpeg_type);
  if (png == true) return png_type;
  if (jpeg == true) return jpeg_type;
  if (!accepts(accept, "image/*") || (png && jpeg)) return {};
  return png ? jpeg_type : png_type;
}

std::string_view media_type(std::string_view header) {
  const auto type = header.substr(0, header.find(';'));
  return type.substr(0, type.find_last_not_of(' ') + 1);
}

}  // namespace

unsigned status_of(rr::ErrorCode code) {
  using enum rr::ErrorCode;
  switch (code) {
    case service_not_found:
    case object_not_found:
    case node_not_found:
    case member_not_found:
    case key_not_found:
    case resource_not_found:
    case invalid_endpoint:
      return 404;
    case invalid_argument:
    case data_type_mismatch:
    case data_type_error:
    case data_serialization_error:
    case member_format_mismatch:
    case message_element_not_found:
    case null_value:
    case out_of_range:
      return 400;
    case authentication_error:
      return 401;
    case permission_denied:
    case system_resource_permission_denied:
      return 403;
    case read_only_member:
    case write_only_member:
      return 405;
    case invalid_operation:
    case invalid_state:
    case member_busy:
    case value_not_set:
    case operation_aborted:
    case abort_operation:
    case operation_cancelled:
      return 409;
    case buffer_limit_violation:
      return 413;
    case object_locked_error:
      return 423;
    case not_implemented_error:
      return 501;
    case connection_error:
    case out_of_system_resource:
      return 503;
    case request_timeout:
    case operation_timeout:
      return 504;
    case remote_error:
    case operation_failed:
      return 422;
    default:
      return 502;
  }
}

bool is_apart(const rr::TypeDefinition& type) {
  return type.name.empty() && type.type != rr::DataType::varvalue_t;
}

bool is_apart(const std::vector<rr::ParameterDefinition>& parameters) {
  return std::all_of(parameters.begin(), parameters.end(), [](const auto& each) { return is_apart(each.type); });
}

rr::awaitable<rr::OrderedJson> json_of(const Target& target, const rr::Value& value, const rr::JsonForm& form,
                                       Workers& workers) {
  const auto make = [&] { return to_json(target, value, form); };
  if (rr::held_bytes(value) <= large_json_bytes || !is_apart(target.member->type)) co_return make();
  co_return co_await workers.run(make);
}

rr::Result<SessionKey> session_key(GatewayState& gateway, const Request& request, std::string service) {
  SessionKey key{std::move(service)};
  if (gateway.http_access().takes_basic()) return key;
  auto basic = basic_credentials(request.header(http::field::authorization));
  if (!basic) return basic.error();
  if (!*basic) return key;
  key.username = std::move((*basic)->username);
  key.password = std::move((*basic)->password);
  return key;
}

rr::awaitable<rr::Result<std::shared_ptr<ValueClient>>> open_session(GatewayState& gateway,
                                                                     std::shared_ptr<Device> device, SessionKey key,
                                                                     ClientOrigin from) {
  if (key.username.empty() || gateway.clients().has(*device, key))
    co_return co_await gateway.clients().open(std::move(device), std::move(key));
  const DeviceLogin login{key.username, device->config().name, key.service, std::move(from)};
  const auto ticket = gateway.logins().begin_at_device(login);
  if (!ticket) co_return ticket.error();
  const auto opened = co_await gateway.clients().open(std::move(device), std::move(key));
  gateway.logins().finish_at_device(login, opened ? rr::Result<>() : opened.error());
  co_return opened;
}

AccessRequest access_request(const Target& target, Verb verb) {
  const auto& upstream = *target.client->upstream();
  const auto& device = upstream.device().config();
  AccessRequest out{.device = device.name, .service = upstream.service(), .path = target.path(), .verb = verb};
  if (!target.member) return out;
  out.member = target.member->name;
  out.is_shape = target.is_shape && verb == Verb::read;
  out.is_vital = device.leases.is_urgent(target.path() + "." + target.member->name);
  return out;
}

rr::JsonForm json_form(const Request& request) {
  rr::JsonForm out;
  out.packs_arrays = rr::query_value(request.query(), "arrays") == "packed";
  out.numbers_enums = rr::query_value(request.query(), "enums") == "number";
  out.ignores_unknown = rr::query_value(request.query(), "unknown") == "ignore";
  return out;
}

ObjectRequest::ObjectRequest(ResponseWriter& writer, GatewayState& gateway) : writer_(writer), gateway_(gateway) {
  const auto accept = request().list(http::field::accept);
  wants_events_ = accepts(accept, "text/event-stream");
  if (accepts(accept, "application/cbor")) wanted_ = BodyForm::cbor;
  if (accepts(accept, "application/octet-stream")) wanted_ = BodyForm::bytes;
  const auto as = option("as").value_or("");
  wants_motion_ = as == "mjpeg" || (as.empty() && accepts(accept, "multipart/x-mixed-replace"));
  if (as == "jpeg" || as == "png") wanted_image_ = as == "jpeg" ? jpeg_type : png_type;
  if (as.empty()) wanted_image_ = accepted_image(accept);
  form_ = json_form(request());
  form_.has_bytes = wanted_ == BodyForm::cbor;
}

std::optional<std::string> ObjectRequest::option(std::string_view name) const {
  return rr::query_value(request().query(), name);
}

bool ObjectRequest::has_bytes_body() const {
  return equals_ignoring_case(media_type(request().header(http::field::content_type)), "application/octet-stream");
}

bool ObjectRequest::has_cbor_body() const {
  return equals_ignoring_case(media_type(request().header(http::field::content_type)), "application/cbor");
}

bool ObjectRequest::has_large_body() const {
  return request().message.body().size() > large_json_bytes;
}

/// Takes room for what the body becomes.
rr::awaitable<rr::Result<>> ObjectRequest::admit_body(MemoryBudget::Charge& room) const {
  const auto type = media_type(request().header(http::field::content_type));
  const auto& text = request().message.body();
  const bool is_cbor = has_cbor_body();
  // A page of another origin can send text/plain without being asked; JSON it can't.
  if (!is_cbor && !equals_ignoring_case(type, "application/json"))
    co_return rr::make_error(rr::ErrorCode::invalid_argument,
                             "Content-Type is " + rr::quote(type) + ", expected application/json or application/cbor");
  const auto measure = [&text, is_cbor] {
    return is_cbor ? rr::memory_of_cbor(rr::as_bytes(text)) : rr::memory_of_json(text);
  };
  // Named: g++ 12 destroys twice what a co_await within ?: gives.
  std::size_t needed = 0;
  if (has_large_body())
    needed = co_await gateway_.workers().run(measure);
  else
    needed = measure();
  if (writer_.is_urgent(text.size())) {
    room.hold(needed);
  } else if (!room.resize(needed)) {
    gateway_.reject(Rejection::memory);
    co_return rr::make_error(rr::ErrorCode::out_of_system_resource,
                             "the gateway has no memory left for what a document of " + std::to_string(text.size()) +
                                 " bytes becomes; try again in a moment");
  }
  co_return rr::Result<>();
}

rr::Result<rr::Json> ObjectRequest::read_body() const {
  const auto& text = request().message.body();
  return has_cbor_body() ? rr::read_cbor(rr::as_bytes(text)) : rr::read_json(text);
}

rr::awaitable<Response> ObjectRequest::value_response(const Target& target, const rr::Value& value,
                                                      std::string_view name) const {
  auto json = co_await json_of(target, value, form_, gateway_.workers());
  if (name.empty()) co_return co_await value_response(std::move(json));
  auto named = rr::OrderedJson::object();
  rr::add_key(named, name) = std::move(json);
  co_return co_await value_response(std::move(named));
}

rr::awaitable<Response> ObjectRequest::value_response(rr::OrderedJson json) const {
  const bool is_cbor = wanted_ == BodyForm::cbor;
  auto body = co_await write_document(std::move(json), is_cbor);
  if (!body) co_return refuse_for_memory(&gateway_.metrics());
  auto response = text_response(200, is_cbor ? "application/cbor" : "application/json", std::move(*body));
  response.set("Cache-Control", "no-store");
  co_return response;
}

rr::awaitable<std::optional<std::string>> ObjectRequest::write_document(rr::OrderedJson json, bool is_cbor) const {
  const auto held = held_bytes(json);
  auto room = writer_.memory().sibling();
  if (held > large_json_bytes && !room.resize(held)) co_return std::nullopt;
  // It is the worker that frees a large one, too: that takes as long as to write it.
  auto write = [json = std::move(json), is_cbor] {
    if (!is_cbor) return rr::write_json(json) + "\n";
    const auto bytes = rr::write_cbor(json);
    return std::string(bytes.begin(), bytes.end());
  };
  if (held <= large_json_bytes) co_return write();
  co_return co_await gateway_.workers().run(std::move(write));
}

Response ObjectRequest::written_response() const {
  Response response;
  response.status = 204;
  return response;
}

Response ObjectRequest::error_response(const rr::Error& error, const rr::TypeRegistry* types) const {
  static const rr::TypeRegistry no_types;
  const auto status = status_of(error.code);
  auto problem = rr::OrderedJson::object();
  const auto told = rr::error_to_json(error, types ? *types : no_types);
  rr::add_key(problem, "type") = "about:blank";
  rr::add_key(problem, "title") = std::string(error_code_name(error.code));
  rr::add_key(problem, "status") = status;
  rr::add_key(problem, "detail") = told["error"]["message"];
  rr::add_key(problem, "error") = told["error"];
  auto response = text_response(status, "application/problem+json", rr::write_json(problem) + "\n");
  response.set("Cache-Control", "no-store");
  if (status == 401) response.set("WWW-Authenticate", device_challenge);
  if (status == 503) response.set("Retry-After", "2");
  return response;
}

Response ObjectRequest::method_response(std::string_view allowed) const {
  auto response = problem_response(405, "method not supported here; supported: " + std::string(allowed));
  response.set("Allow", std::string(allowed));
  return response;
}

rr::Called Target::request(rr::CallKind kind) const {
  rr::Called out;
  out.kind = kind;
  out.object = object;
  out.member = member;
  return out;
}

rr::awaitable<rr::Value> Target::ask(rr::CallKind kind) const {
  return client->ask(request(kind));
}

rr::awaitable<rr::Value> Target::ask(rr::CallKind kind, rr::Value value) const {
  auto wanted = request(kind);
  wanted.arguments.push_back(std::move(value));
  return client->ask(std::move(wanted));
}

rr::awaitable<rr::Result<std::shared_ptr<Target>>> find_target(std::shared_ptr<ValueClient> client,
                                                               std::vector<std::string> segments, LookJudge may_look) {
  const auto upstream = client->upstream();
  const auto target = std::make_shared<Target>();
  target->client = client;
  const auto go_to = [&](const std::string& path) {
    target->registry = upstream->types();
    target->type = upstream->object_type(path);
    if (!target->type) return false;
    target->object = std::make_shared<SharedObject>(path, target->type->qualified_name);
    return true;
  };
  if (!go_to(upstream->service())) co_return upstream->lost_error();
  for (std::size_t i = 0; i < segments.size(); ++i) {
    const auto& name = segments[i];
    const auto* member = target->type->find_member(name);
    if (!member)
      co_return rr::make_error(rr::ErrorCode::member_not_found, "object " + rr::quote(target->path()) + " (" +
                                                                    target->type->qualified_name + ") has no member " +
                                                                    rr::quote(name));
    if (member->kind != rr::MemberKind::objref) {
      target->member = member;
      target->is_shape =
          member->kind == rr::MemberKind::memory && i + 2 == segments.size() && segments[i + 1] == "shape";
      if (i + 1 == segments.size() || target->is_shape) break;
      co_return rr::make_error(rr::ErrorCode::object_not_found, rr::quote(name) + " is no object; nothing is below it");
    }
    std::optional<std::string> index;
    if (member->is_indexed()) {
      if (++i == segments.size())
        co_return rr::make_error(rr::ErrorCode::object_not_found,
                                 "objref " + rr::quote(name) + " needs an index: .../" + name + "/INDEX");
      index = segments[i];
    }
    const auto path = rr::child_path(target->path(), name, index);
    const AccessRequest object{
        .device = upstream->device().config().name, .service = upstream->service(), .path = path};
    if (const auto allowed = may_look(object); !allowed) co_return allowed.error();
    if (!upstream->object_type(path)) co_await client->find_object(path);
    if (!go_to(path)) co_return rr::make_error(rr::ErrorCode::object_not_found, "the object has gone");
  }
  co_return target;
}

}  // namespace rrgate
