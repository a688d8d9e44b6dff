#include "server/http/endpoints/objects.hpp"

#include "node/http/origin.hpp"
#include "server/access/standing.hpp"
#include "server/http/endpoints/call_log.hpp"
#include "server/http/endpoints/device_resources.hpp"
#include "server/http/endpoints/devices.hpp"
#include "server/http/endpoints/image_values.hpp"
#include "server/http/endpoints/leases.hpp"
#include "server/http/endpoints/member_values.hpp"
#include "server/http/endpoints/members.hpp"
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

rr::awaitable<void> refuse(GatewayState& gateway, ResponseWriter& writer, const rr::Error& why) {
  gateway.reject(why);
  const auto refusal = gateway.http_access().refusal(writer.request(), why);
  co_await writer.send(refusal);
}

/// Where the path leads to in the session of a client. Null: it is answered why it leads nowhere.
rr::awaitable<std::shared_ptr<Target>> find_asked(const ObjectRequest& request, std::shared_ptr<ValueClient> client,
                                                  std::vector<std::string> segments) {
  auto& gateway = request.gateway();
  const auto& asked = request.request();
  if (const auto holder = gateway.lease_holders().find(asked.header(lease_header));
      holder != gateway.lease_holders().end() && holder->second.client->upstream() == client->upstream())
    client = holder->second.client;
  std::optional<rr::Error> unseen;
  LookJudge may_look = [&](const AccessRequest& object) {
    auto allowed = gateway.access().check(asked.identity, object);
    if (!allowed) unseen = allowed.error();
    return allowed;
  };
  std::optional<rr::Error> error;
  std::shared_ptr<Target> target;
  try {
    target = value_or_throw(co_await find_target(std::move(client), std::move(segments), std::move(may_look)));
  } catch (const rr::Exception& exception) {
    error = exception.error();
  }
  if (unseen) {
    co_await refuse(gateway, request.writer(), *unseen);
  } else if (error) {
    const auto response = request.error_response(*error, nullptr);
    co_await request.writer().send(response);
  }
  co_return target;
}

/// What is to be recorded of the request; null: nothing. nullopt: it is answered why it may not be made.
rr::awaitable<std::optional<AuditEntryPtr>> judge_asked(const ObjectRequest& request, std::shared_ptr<Target> target,
                                                        std::string trace, bool needs_right) {
  auto& gateway = request.gateway();
  auto& writer = request.writer();
  auto wanted = access_request(*target, verb_of(request, *target));
  if (!target->member && request.option("lease") == "renew") wanted.is_vital = true;
  const auto lease = request.request().header(lease_header);
  const bool has_ended = !lease.empty() && !gateway.lease_holders().contains(lease);
  // What was sent under a lease moves nothing once it has ended, though nobody else has one.
  if (has_ended && !request.is_read() && !request.option("lease") && !wanted.is_vital) {
    const auto ended =
        rr::make_error(rr::ErrorCode::object_locked_error, "the lease of this Rrgate-Lease has ended: take it again");
    const auto response = request.error_response(ended, nullptr);
    co_await writer.send(response);
    co_return std::nullopt;
  }
  auto who = request.request().identity;
  if (wanted.verb == Verb::subscribe) who.face = Face::stream;
  const auto event = lease_event(request, *target);
  rr::Result<AuditEntryPtr> begun = AuditEntryPtr();
  if (event)
    begun = gateway.access().check_and_begin(who, wanted, trace, *event);
  else if (const auto allowed = needs_right ? gateway.access().check(who, wanted) : rr::Result<>(); !allowed)
    begun = allowed.error();
  if (!begun) {
    co_await refuse(gateway, writer, begun.error());
    co_return std::nullopt;
  }
  const bool is_generator = target->member && target->member->is_generator();
  if (wanted.verb == Verb::subscribe || is_generator)
    writer.go_on_while([standing = std::make_shared<Standing>(gateway.access(), who), target, verb = wanted.verb] {
      return !target->client->upstream()->is_closed() &&
             standing->check(access_request(*target, verb), Recorded::never).has_value();
    });
  co_return std::move(*begun);
}

/// False: it is answered why the request goes no further.
rr::awaitable<bool> read_asked(const ObjectRequest& request, const Target& target, bool needs_right) {
  Standing standing(request.gateway().access(), request.request().identity);
  if (const auto failed = co_await request.writer().read_body()) {
    co_await request.writer().send(*failed);
    co_return false;
  }
  // A body may take minutes, in which a right may be taken away.
  const auto still = standing.check(access_request(target, verb_of(request, target)), Recorded::never);
  if (still || !needs_right) co_return true;
  co_await refuse(request.gateway(), request.writer(), still.error());
  co_return false;
}

/// `segments`  of the path, from the device's name on.
rr::awaitable<void> serve_object(const ObjectRequest& request, Device& device, std::vector<std::string> segments) {
  auto& writer = request.writer();
  auto key = session_key(request.gateway(), request.request(), segments[1]);
  if (!key) {
    const auto response = request.error_response(key.error(), nullptr);
    co_await writer.send(response);
    co_return;
  }
  const auto traceparent = request.request().header("traceparent");
  auto trace = trace_id_of(traceparent);
  if (!trace.empty()) writer.add_header("traceparent", std::string(traceparent));
  const auto method = request.request().message.method_string();
  const CallLog logged(trace, device.config().name, {method.data(), method.size()},
                       std::string(request.request().path()));
  auto from = request.request().origin();
  auto asked = device.shared_from_this();
  const auto client = co_await open_session(request.gateway(), std::move(asked), std::move(*key), std::move(from));
  if (!client) {
    const auto response = request.error_response(client.error(), nullptr);
    co_await writer.send(response);
    co_return;
  }
  segments.erase(segments.begin(), segments.begin() + 2);
  auto used = *client;
  const auto target = co_await find_asked(request, std::move(used), std::move(segments));
  if (!target) co_return;
  const bool needs_right = !releases_own_lease(request, *target);
  auto sought = target;
  const auto entry = co_await judge_asked(request, std::move(sought), std::move(trace), needs_right);
  if (!entry) co_return;
  std::optional<rr::Error> error;
  if (*entry)
    writer.on_begin([&entry, &error](unsigned status) {
      if (status < 400) return (*entry)->finish({});
      (*entry)->finish(Outcome::error, error ? error->message : "answered with status " + std::to_string(status));
    });
  if (!writer.is_at_work()) {
    const bool goes_on = co_await read_asked(request, *target, needs_right);
    if (!goes_on) co_return;
  }
  try {
    co_await serve_target(request, *target);
  } catch (const rr::Exception& exception) {
    error = exception.error();
  }
  if (!error) co_return;
  const auto response = request.error_response(*error, &target->types());
  co_await writer.send(response);
}

rr::awaitable<void> serve(GatewayState& gateway, ResponseWriter& writer, std::vector<std::string> segments) {
  const ObjectRequest request(writer, gateway);
  const bool is_resource = segments.size() == 2 && is_device_resource(segments[1]);
  const auto service = segments.size() > 1 && !is_resource ? segments[1] : std::string();
  std::optional<RateGate::Pass> pass;
  if (const auto refusal = refuse_device(gateway, writer.request(), segments.front(), service, pass)) {
    co_await writer.send(*refusal);
    co_return;
  }
  auto* device = gateway.devices().find(segments.front());
  if (segments.size() == 1) {
    const auto response = request.is_read() ? describe_device(*device, writer.request(), gateway.access())
                                            : request.method_response("GET, HEAD");
    co_await writer.send(response);
  } else if (is_resource) {
    co_await serve_device_resource(request, *device, segments[1]);
  } else {
    co_await serve_object(request, *device, std::move(segments));
  }
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
  const auto* device = gateway.devices().find(segments->front());
  std::string place = (*segments)[1];
  for (std::size_t i = 2; i < segments->size(); ++i) place += "." + (*segments)[i];
  const auto* leases = device ? &device->config().leases : nullptr;
  if (leases && method == http::verb::post && takes_lease(request) && leases->makes_safe(place))
    return UrgentCommand{(*segments)[0], (*segments)[1], Verb::lock};
  const bool is_member = segments->size() > 2;
  if (!gives_back && !(leases && is_member && leases->is_urgent(place))) return {};
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
