#include "server/http/endpoints/objects.hpp"

#include "server/http/endpoints/call_log.hpp"
#include "server/http/endpoints/device_documents.hpp"
#include "server/http/endpoints/devices.hpp"
#include "server/http/endpoints/image_values.hpp"
#include "server/http/endpoints/member_values.hpp"
#include "server/http/endpoints/members.hpp"
#include "server/http/origin.hpp"
#include "server/log/log.hpp"

namespace rrgate {

namespace {

rr::awaitable<void> serve_target(const ObjectRequest& request, const Target& target) {
  if (!target.member) {
    auto response =
        request.is_read() ? request.value_response(describe_object(target)) : request.method_response("GET, HEAD");
    co_await request.writer().send(response);
    co_return;
  }
  const auto& member = *target.member;
  const bool is_topic = member.kind == rr::MemberKind::event || member.kind == rr::MemberKind::pipe ||
                        (member.kind == rr::MemberKind::wire && member.direction() != rr::MemberDirection::writeonly);
  const bool is_motion = is_topic && member.kind != rr::MemberKind::event && is_image_type(member.type, target.types());
  if (is_motion && request.is_read() && request.wants_motion()) {
    co_await stream_images(request, target);
  } else if (is_topic && request.is_read() && request.wants_events()) {
    co_await stream_topic(request, target);
  } else if (member.kind == rr::MemberKind::function && member.is_generator()) {
    co_await stream_generator(request, target);
  } else {
    co_await answer_member(request, target);
  }
}

constexpr std::string_view definition_suffix = ".robdef";

bool is_definition(std::string_view name) {
  return name.size() > definition_suffix.size() && name.ends_with(definition_suffix);
}

/// A document about the device, or one of its definitions: from sessions with all its services.
rr::awaitable<void> serve_document(Gateway& gateway, Device& device, const ObjectRequest& request, std::string name) {
  auto& writer = request.writer();
  std::vector<std::shared_ptr<DeviceSession>> sessions;
  std::vector<rr::AsyncObject> roots;  // their connections keep the definitions
  std::vector<DescribedService> services;
  std::vector<std::string> unavailable;
  std::vector<std::string> names;
  if (const auto& identity = device.identity())
    for (const auto& service : identity->services) names.push_back(service.name);
  const auto device_name = device.config().name;  // a found device may be lost meanwhile
  for (const auto& service : names) {
    auto* still_there = gateway.devices().find(device_name);
    auto session = still_there ? gateway.sessions().open(*still_there, request.key(service))
                               : rr::Result<std::shared_ptr<DeviceSession>>(rr::Error{});
    if (session) {
      sessions.push_back(*session);
      auto root = co_await sessions.back()->root();
      if (root) {
        const auto& known = root->connection()->session();
        services.push_back({service, known.object_type(root->path())->qualified_name, &known.types()});
        roots.push_back(std::move(*root));
        continue;
      }
    }
    unavailable.push_back(service);
  }
  Response response;
  if (services.empty()) {
    response = problem_response(503, "device " + rr::quoted(device_name) + " has no service that answers");
    response.set("Retry-After", "2");
  } else if (is_definition(name)) {
    const auto wanted = name.substr(0, name.size() - definition_suffix.size());
    response = problem_response(404, "the device has no definition " + rr::quoted(wanted));
    for (const auto& service : services)
      if (const auto* definition = service.types->find_service(wanted))
        response = with_etag(text_response(200, "text/plain; charset=utf-8", definition->text), writer.request());
  } else {
    const auto base = writer.request().arrival.prefix + "/api/v1/devices/" + rr::percent_encode(device_name);
    response = with_etag(device_document(name, device_name, base, services, unavailable), writer.request());
  }
  co_await writer.send(response);
}

rr::awaitable<void> serve(Gateway& gateway, ResponseWriter& writer, std::vector<std::string> segments) {
  const ObjectRequest request(writer);
  auto* device = gateway.devices().find(segments.front());
  if (!device) {
    auto response = problem_response(404, "no device " + rr::quoted(segments.front()) + "; /api/v1/devices lists them");
    co_await writer.send(response);
    co_return;
  }
  if (segments.size() == 1) {
    auto response =
        request.is_read() ? describe_device(*device, writer.request()) : request.method_response("GET, HEAD");
    co_await writer.send(response);
    co_return;
  }
  if (segments.size() == 2 && segments[1] == "subscriptions") {
    const auto response =
        request.is_read() ? list_subscriptions(gateway, *device) : request.method_response("GET, HEAD");
    co_await writer.send(response);
    co_return;
  }
  if (segments.size() == 2 && (is_device_document(segments[1]) || is_definition(segments[1]))) {
    if (request.is_read()) {
      co_await serve_document(gateway, *device, request, segments[1]);
    } else {
      const auto response = request.method_response("GET, HEAD");
      co_await writer.send(response);
    }
    co_return;
  }
  const auto traceparent = writer.request().header("traceparent");
  auto trace = trace_id_of(traceparent);
  if (!trace.empty()) writer.add_header("traceparent", std::string(traceparent));
  const auto method = writer.request().message.method_string();
  const CallLog logged(std::move(trace), device->config().name, {method.data(), method.size()},
                       std::string(writer.request().path()));
  auto session = gateway.sessions().open(*device, request.key(segments[1]));
  segments.erase(segments.begin(), segments.begin() + 2);
  std::optional<rr::Error> error;
  std::shared_ptr<Target> target;
  if (session) {
    auto found = co_await find_target(*session, std::move(segments));
    if (found)
      target = *found;
    else
      error = found.error();
  } else {
    error = session.error();
  }
  try {
    if (target) co_await serve_target(request, *target);
  } catch (const rr::Exception& exception) {
    error = exception.error();
  }
  if (!error) co_return;
  auto response = request.error_response(*error, target ? &target->types() : nullptr);
  co_await writer.send(response);
}

/// A page of another origin may read and write only where the configuration lists it.
bool admit_origin(Gateway& gateway, ResponseWriter& writer) {
  const auto& request = writer.request();
  const auto origin = request.header(http::field::origin);
  if (origin.empty()) return true;
  if (!is_origin_allowed(origin, request.header(http::field::host), gateway.config().allowed_origins)) return false;
  writer.add_header("Access-Control-Allow-Origin", std::string(origin));
  writer.add_header("Vary", "Origin");
  return true;
}

rr::awaitable<void> answer(Gateway& gateway, ResponseWriter& writer, std::string rest) {
  Response response;
  const auto& request = writer.request();
  auto segments = split_path(rest);
  if (!admit_origin(gateway, writer)) {
    response = problem_response(403, "origin " + rr::quoted(request.header(http::field::origin)) +
                                         " is not allowed; see allowed_origins of the gateway's configuration");
  } else if (request.message.method() == http::verb::options) {
    response.status = 204;
    response.set("Access-Control-Allow-Methods", "GET, HEAD, PUT, POST");
    response.set("Access-Control-Allow-Headers",
                 "Accept, Authorization, Content-Type, Last-Event-ID, Range, traceparent");
    response.set("Access-Control-Max-Age", "600");
  } else if (!segments || segments->empty()) {
    response = problem_response(404, segments ? "expected /api/v1/devices/NAME" : segments.error().message);
  } else {
    co_await serve(gateway, writer, std::move(*segments));
    co_return;
  }
  co_await writer.send(response);
}

}  // namespace

Handler objects_endpoint(Gateway& gateway) {
  return [&gateway](const Request&, std::string_view rest) {
    Response response;
    response.answer_later = [&gateway, rest = std::string(rest)](ResponseWriter& writer) {
      return answer(gateway, writer, rest);
    };
    return response;
  };
}

}  // namespace rrgate
