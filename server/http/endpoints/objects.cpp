#include "server/http/endpoints/objects.hpp"

#include <algorithm>

#include "node/http/origin.hpp"
#include "node/tls/digest.hpp"
#include "server/access/standing.hpp"
#include "server/http/endpoints/call_log.hpp"
#include "server/http/endpoints/device_documents.hpp"
#include "server/http/endpoints/devices.hpp"
#include "server/http/endpoints/image_values.hpp"
#include "server/http/endpoints/leases.hpp"
#include "server/http/endpoints/member_values.hpp"
#include "server/http/endpoints/members.hpp"
#include "server/http/etag.hpp"
#include "server/log/log.hpp"
#include "server/state/http_access.hpp"

namespace rrgate {

namespace {

/// What a request gets from where its path leads to.
enum class Answer : std::uint8_t { description, lease, images, topic, generator, member };

Answer answer_to(const ObjectRequest& request, const Target& target) {
  if (!target.member) return request.option("lease") ? Answer::lease : Answer::description;
  const auto& member = *target.member;
  const bool can_receive = member.direction() != rr::MemberDirection::writeonly;
  const bool is_topic = member.kind == rr::MemberKind::event ||
                        ((member.kind == rr::MemberKind::pipe || member.kind == rr::MemberKind::wire) && can_receive);
  const bool is_motion = is_topic && member.kind != rr::MemberKind::event && is_image_type(member.type, target.types());
  if (is_motion && request.is_read() && request.wants_motion()) return Answer::images;
  if (is_topic && request.is_read() && request.wants_events()) return Answer::topic;
  return member.kind == rr::MemberKind::function && member.is_generator() ? Answer::generator : Answer::member;
}

/// What a request does to a member.
Verb verb_of(const ObjectRequest& request, const Target& target) {
  switch (answer_to(request, target)) {
    case Answer::description:
      return Verb::read;
    case Answer::lease:
      return Verb::lock;
    case Answer::images:
    case Answer::topic:
      return Verb::subscribe;
    default:
      break;
  }
  switch (target.member->kind) {
    case rr::MemberKind::property:
    case rr::MemberKind::memory:
    case rr::MemberKind::wire:
      return request.method() == http::verb::put ? Verb::write : Verb::read;
    case rr::MemberKind::event:
    case rr::MemberKind::pipe:
      return Verb::subscribe;
    default:
      return Verb::call;
  }
}

rr::awaitable<void> serve_target(const ObjectRequest& request, const Target& target) {
  switch (answer_to(request, target)) {
    case Answer::description: {
      auto response = request.method_response("GET, HEAD");
      if (request.is_read()) {
        const auto described = describe_object(target);
        response = co_await request.value_response(described);
      }
      co_await request.writer().send(response);
      break;
    }
    case Answer::lease: {
      const auto response = co_await answer_lease(request, target);
      co_await request.writer().send(response);
      break;
    }
    case Answer::images:
      co_await stream_images(request, target);
      break;
    case Answer::topic:
      co_await stream_topic(request, target);
      break;
    case Answer::generator:
      co_await stream_generator(request, target);
      break;
    case Answer::member:
      co_await answer_member(request, target);
      break;
  }
}

constexpr std::string_view objects_prefix = "/api/v1/devices/";

/// Why a request for a device, or a service of it, goes no further: there is no right to anything of it, it is not
/// there, or it is asked for too much. Rights come first: strangers are not told what there is. nullopt: go on, with
/// the pass.
std::optional<Response> refuse_device(GatewayState& gateway, const Request& request, const std::string& device,
                                      const std::string& service, std::optional<RateGate::Pass>& pass) {
  const AccessRequest asked{.device = device, .service = service};
  if (const auto allowed = gateway.access().check(request.identity, asked); !allowed) {
    gateway.reject(Rejection::forbidden);
    return gateway.http_access().refusal(request, allowed.error());
  }
  if (!gateway.devices().find(device)) return no_such_device(device);
  pass = gateway.http_access().enter_device(device, gateway.config().rates);
  if (pass || find_urgent(gateway, request)) return std::nullopt;
  gateway.reject(Rejection::rate);
  return gateway.http_access().refuse_too_much(request.identity, &asked, "to the device");
}

constexpr std::string_view definition_suffix = ".robdef";

bool is_definition(std::string_view name) {
  return name.size() > definition_suffix.size() && name.ends_with(definition_suffix);
}

bool is_device_resource(std::string_view name) {
  return std::find(device_resources.begin(), device_resources.end(), name) != device_resources.end();
}

/// As device_document(), which takes a tenth of a second for a robot: made anew when what it is made of is another.
Response find_document(GatewayState& gateway, const std::string& document, const std::string& device,
                       const std::string& base, const std::vector<DescribedService>& services,
                       const std::vector<std::string>& unavailable) {
  std::string made_of;
  const auto add = [&made_of](std::string_view part) { made_of.append(part).push_back('\0'); };
  for (const auto* part : {&document, &device, &base}) add(*part);
  for (const auto& service : services) {
    add(service.name);
    add(service.root_type);
    for (const auto& definition : service.types->definitions()) add(definition->text);
  }
  for (const auto& service : unavailable) add(service);
  const auto digest = rr::sha256(rr::Bytes(made_of.begin(), made_of.end()));
  auto& known = gateway.documents().at(std::string(digest.begin(), digest.end()));
  if (!known.body) known = device_document(document, device, base, services, unavailable);
  return known;
}

/// A document about the device, or one of its definitions: from sessions with all its services. `login`  of each.
rr::awaitable<void> serve_document(GatewayState& gateway, Device& device, const ObjectRequest& request,
                                   std::string name, SessionKey login) {
  auto& writer = request.writer();
  std::vector<std::shared_ptr<const rr::TypeRegistry>> kept;
  std::vector<DescribedService> services;
  std::vector<std::string> unavailable;
  std::vector<std::string> names;
  if (const auto& identity = device.identity())
    for (const auto& service : identity->services)
      if (gateway.access().sees(request.request().identity, device.config().name, service.name))
        names.push_back(service.name);
  const auto device_name = device.config().name;  // a found device may be lost meanwhile
  for (const auto& service : names) {
    auto* still_there = gateway.devices().find(device_name);
    if (!still_there) break;
    auto key = login;
    key.service = service;
    auto from = writer.request().origin();
    auto asked = still_there->shared_from_this();
    const auto client = co_await open_session(gateway, std::move(asked), std::move(key), std::move(from));
    const auto* root = client ? (*client)->upstream()->object_type(service) : nullptr;
    const auto types = client ? (*client)->upstream()->types() : nullptr;
    const DescribedService described{service, root ? root->qualified_name : "", types.get()};
    if (root && (is_definition(name) || fits_beside(described, services))) {
      kept.push_back(types);
      services.push_back(described);
    } else {
      unavailable.push_back(service);
    }
  }
  Response response;
  if (services.empty()) {
    response = problem_response(503, "device " + rr::quote(device_name) + " has no service that answers");
    response.set("Retry-After", "2");
  } else if (is_definition(name)) {
    const auto wanted = name.substr(0, name.size() - definition_suffix.size());
    response = problem_response(404, "the device has no definition " + rr::quote(wanted));
    for (const auto& service : services)
      if (const auto* definition = service.types->find_service(wanted))
        response = with_etag(text_response(200, "text/plain; charset=utf-8", definition->text), writer.request());
  } else {
    const auto base = writer.request().arrival.prefix + "/api/v1/devices/" + rr::percent_encode(device_name);
    response = find_document(gateway, name, device_name, base, services, unavailable);
    if (response.status == 200) response = with_etag(std::move(response), writer.request());
  }
  co_await writer.send(response);
}

rr::awaitable<void> refuse(GatewayState& gateway, ResponseWriter& writer, const rr::Error& why) {
  gateway.reject(why);
  const auto refusal = gateway.http_access().refusal(writer.request(), why);
  co_await writer.send(refusal);
}

rr::awaitable<void> serve(GatewayState& gateway, ResponseWriter& writer, std::vector<std::string> segments) {
  const ObjectRequest request(writer, gateway);
  const bool is_about_all = segments.size() == 2 && (is_device_resource(segments[1]) || is_definition(segments[1]));
  const bool is_object = segments.size() > 1 && !is_about_all;
  const auto service = is_object ? segments[1] : std::string();
  std::optional<RateGate::Pass> pass;
  if (const auto refusal = refuse_device(gateway, writer.request(), segments.front(), service, pass)) {
    co_await writer.send(*refusal);
    co_return;
  }
  auto* device = gateway.devices().find(segments.front());
  if (segments.size() == 1) {
    auto response = request.is_read() ? describe_device(*device, writer.request(), gateway.access())
                                      : request.method_response("GET, HEAD");
    co_await writer.send(response);
    co_return;
  }
  if (segments.size() == 2 && segments[1] == "subscriptions") {
    const auto response = request.is_read() ? list_subscriptions(gateway, writer.request().identity, *device)
                                            : request.method_response("GET, HEAD");
    co_await writer.send(response);
    co_return;
  }
  auto key = session_key(gateway, writer.request(), service);
  if (!key) {
    const auto response = request.error_response(key.error(), nullptr);
    co_await writer.send(response);
    co_return;
  }
  if (!is_object) {
    if (request.is_read()) {
      co_await serve_document(gateway, *device, request, segments[1], std::move(*key));
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
  const CallLog logged(trace, device->config().name, {method.data(), method.size()},
                       std::string(writer.request().path()));
  auto from = writer.request().origin();
  auto asked = device->shared_from_this();
  const auto client = co_await open_session(gateway, std::move(asked), std::move(*key), std::move(from));
  segments.erase(segments.begin(), segments.begin() + 2);
  std::optional<rr::Error> error;
  std::shared_ptr<Target> target;
  if (client) {
    auto used = *client;
    if (const auto holder = gateway.lease_holders().find(writer.request().header(lease_header));
        holder != gateway.lease_holders().end() && holder->second.client->upstream() == used->upstream())
      used = holder->second.client;
    std::optional<rr::Error> unseen;
    LookJudge may_look = [&](const AccessRequest& object) {
      auto allowed = gateway.access().check(writer.request().identity, object);
      if (!allowed) unseen = allowed.error();
      return allowed;
    };
    try {
      target = value_or_throw(co_await find_target(std::move(used), std::move(segments), std::move(may_look)));
    } catch (const rr::Exception& exception) {
      error = exception.error();
    }
    if (unseen) {
      co_await refuse(gateway, writer, *unseen);
      co_return;
    }
  } else {
    error = client.error();
  }
  AuditEntryPtr entry;
  const bool needs_right = target && !releases_own_lease(request, *target);
  if (target) {
    auto wanted = access_request(*target, verb_of(request, *target));
    if (!target->member && request.option("lease") == "renew") wanted.is_vital = true;
    const auto lease = writer.request().header(lease_header);
    const bool has_ended = !lease.empty() && !gateway.lease_holders().contains(lease);
    // What was sent under a lease moves nothing once it has ended, though nobody else has one.
    if (has_ended && !request.is_read() && !request.option("lease") && !wanted.is_vital) {
      const auto ended =
          rr::make_error(rr::ErrorCode::object_locked_error, "the lease of this Rrgate-Lease has ended: take it again");
      const auto response = request.error_response(ended, nullptr);
      co_await writer.send(response);
      co_return;
    }
    auto who = writer.request().identity;
    if (wanted.verb == Verb::subscribe) who.face = Face::stream;
    const auto event = lease_event(request, *target);
    rr::Result<AuditEntryPtr> begun = AuditEntryPtr();
    if (event)
      begun = gateway.access().check_and_begin(who, wanted, trace, *event);
    else if (const auto allowed = needs_right ? gateway.access().check(who, wanted) : rr::Result<>(); !allowed)
      begun = allowed.error();
    if (!begun) {
      co_await refuse(gateway, writer, begun.error());
      co_return;
    }
    entry = std::move(*begun);
    const bool is_generator = target->member && target->member->is_generator();
    if (wanted.verb == Verb::subscribe || is_generator)
      writer.go_on_while([standing = std::make_shared<Standing>(gateway.access(), who), target, verb = wanted.verb] {
        return !target->client->upstream()->is_closed() &&
               standing->check(access_request(*target, verb), Recorded::never).has_value();
      });
  }
  if (entry)
    writer.on_begin([&entry, &error](unsigned status) {
      if (status < 400) return entry->finish({});
      entry->finish(Outcome::error, error ? error->message : "answered with status " + std::to_string(status));
    });
  if (target && !writer.is_at_work()) {
    Standing standing(gateway.access(), writer.request().identity);
    if (const auto failed = co_await writer.read_body()) {
      co_await writer.send(*failed);
      co_return;
    }
    // A body may take minutes, in which a right may be taken away.
    const auto still = standing.check(access_request(*target, verb_of(request, *target)), Recorded::never);
    if (!still && needs_right) {
      co_await refuse(gateway, writer, still.error());
      co_return;
    }
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

rr::awaitable<void> answer(GatewayState& gateway, ResponseWriter& writer, std::string rest) {
  auto segments = split_path(rest);
  if (segments && !segments->empty()) {
    co_await serve(gateway, writer, std::move(*segments));
    co_return;
  }
  const auto response = problem_response(404, segments ? "expected /api/v1/devices/NAME" : segments.error().message);
  co_await writer.send(response);
}

}  // namespace

std::optional<UrgentCommand> find_urgent(GatewayState& gateway, const Request& request) {
  const auto method = request.message.method();
  const auto path = request.path();
  if (method == http::verb::post && path == "/api/v1/agents/stop") return UrgentCommand{.verb = Verb::admin};
  if ((method != http::verb::post && method != http::verb::put) || !path.starts_with(objects_prefix)) return {};
  const auto segments = split_path(path.substr(objects_prefix.size()));
  if (!segments || segments->size() < 2) return {};
  const bool gives_back = method == http::verb::post && shows_own_lease(gateway, request);
  const auto* device = segments->size() > 2 ? gateway.devices().find(segments->front()) : nullptr;
  std::string place = (*segments)[1];
  for (std::size_t i = 2; i < segments->size(); ++i) place += "." + (*segments)[i];
  if (!gives_back && (!device || !device->config().leases.is_urgent(place))) return {};
  return UrgentCommand{(*segments)[0], (*segments)[1]};
}

Handler objects_endpoint(GatewayState& gateway) {
  return [&gateway](const Request&, std::string_view rest) {
    Response response;
    response.answer_later = [&gateway, rest = std::string(rest)](ResponseWriter& writer) {
      return answer(gateway, writer, rest);
    };
    return response;
  };
}

}  // namespace rrgate
