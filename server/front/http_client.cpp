#include "server/front/http_client.hpp"

#include <functional>

#include "node/http/foreign_page.hpp"
#include "node/http/request_reader.hpp"
#include "node/http/upgrade.hpp"
#include "node/transport/websocket.hpp"
#include "server/access/standing.hpp"
#include "server/front/page_device.hpp"
#include "server/front/refused_client.hpp"
#include "server/front/serve_shared_client.hpp"
#include "server/http/endpoints/object_request.hpp"
#include "server/http/endpoints/objects.hpp"
#include "server/http/other_pages.hpp"
#include "server/http/response_writer.hpp"
#include "server/log/log.hpp"
#include "server/mcp/mcp_endpoint.hpp"
#include "server/relay/client_relay.hpp"
#include "server/socket/json_socket.hpp"
#include "server/state/http_access.hpp"

namespace rrgate {

namespace {

/// Of way_header: 25 gateways in a row.
constexpr std::size_t longest_way = 1024;

constexpr std::string_view devices_prefix = "/devices/";
constexpr std::string_view gateway_path = "/gateway";

Rejection rejection_of(unsigned status) {
  switch (status) {
    case 400:
      return Rejection::bad_request;
    case 401:
      return Rejection::unauthorized;
    case 404:
      return Rejection::no_such_device;
    case 429:
      return Rejection::rate;
    default:
      return Rejection::forbidden;
  }
}

/// What a connection goes on as when HTTP is done with it; not valid() where it has ended.
using Continuation = rr::awaitable<void>;

/// 101: what follows is a WebSocket.
rr::awaitable<rr::error_code> write_acceptance(GatewayState& gateway, rr::ByteStream& stream, std::string_view text) {
  gateway.metrics().respond(101);
  const auto slice = rr::as_bytes(text);
  const std::span<const rr::ByteSpan> slices(&slice, 1);
  co_return co_await stream.write(slices);
}

/// Refuses what is not a request, or not one that goes on.
rr::awaitable<rr::error_code> write_refusal(GatewayState& gateway, rr::ByteStream& stream, const Response& response) {
  gateway.metrics().respond(response.status);
  const auto head = format_response_head(response, false, 1);
  const rr::ByteSpan parts[] = {rr::as_bytes(head), response.body ? rr::as_bytes(*response.body) : rr::ByteSpan()};
  const std::span<const rr::ByteSpan> slices(parts, 2);
  co_return co_await stream.write(slices);
}

/// The node that native clients put into the query. Errors   invalid_argument: no such id.
rr::Result<rr::NodeIdentity> asked_node(const Request& request) {
  rr::NodeIdentity out;
  if (const auto text = rr::query_value(request.query(), "nodeid")) {
    auto parsed = rr::parse_node_id(*text);
    if (!parsed) return parsed.error();
    out.id = *parsed;
  }
  out.name = rr::query_value(request.query(), "nodename").value_or("");
  return out;
}

/// Where an upgrade leads: by path, or at "/" by the node that native clients put into the query. "/gateway" is the
/// gateway's own node, whatever its name is. Who may see nothing is led to a destination of nothing where there is
/// none, and refused there as at a device.
rr::Result<Destination> find_destination(GatewayState& gateway, const Request& request) {
  const auto path = request.path();
  const bool is_stranger = !gateway.access().state().rules.sees_any(request.identity);
  const auto not_found = [](std::string text) {
    return rr::make_error(rr::ErrorCode::node_not_found, std::move(text));
  };
  if (path.substr(0, devices_prefix.size()) == devices_prefix) {
    auto name = path.substr(devices_prefix.size());
    if (!name.empty() && name.back() == '/') name.remove_suffix(1);
    auto* device = gateway.devices().find(name);
    if (!device && is_stranger) return Destination{};
    if (!device) {  // nor are those told so who may see other devices
      if (auto allowed = gateway.access().check(request.identity, {.device = name}); !allowed) return allowed.error();
      return not_found("no device " + rr::quote(name) + "; /api/v1/devices lists them");
    }
    return destination_of(gateway, *device);
  }
  if (path == gateway_path) return Destination{nullptr, &gateway.shared().node()};
  if (path != "/") return not_found("no WebSocket at " + rr::quote(path) + "; expected /devices/NAME, /gateway or /");
  const auto asked = asked_node(request);
  if (!asked) return asked.error();
  const auto destination = find_destination(gateway, asked->id, asked->name);
  if (!destination && is_stranger) return Destination{};
  if (!destination) return not_found("no device is the node that the query names");
  return *destination;
}

/// The URL of the node as the client knows it; empty where it has not told its own. Other nodes are reached at the
/// root, not at the path that always leads to the gateway's own.
std::string node_url(const Request& request) {
  const auto& arrival = request.arrival;
  if (arrival.host.empty()) return {};
  return (arrival.is_encrypted ? "rr+wss://" : "rr+ws://") + arrival.host + arrival.prefix +
         std::string(request.path() == gateway_path ? "/" : request.path());
}

/// 101, then JSON messages.
rr::awaitable<Continuation> accept_json_socket(GatewayState& gateway, Connection& connection,
                                               std::unique_ptr<rr::ByteStream> stream, const Request& request,
                                               rr::ByteSpan unread) {
  const auto place = find_json_socket(gateway, request);
  if (!place) {
    const auto status = status_of(place.error().code);
    gateway.reject(rejection_of(status));
    auto response = status == 403 ? gateway.http_access().refusal(request, place.error())
                                  : problem_response(status, place.error().message);
    if (status == 401) response.set("WWW-Authenticate", device_challenge);
    co_await write_refusal(gateway, *stream, response);
    co_await stream->end(rr::no_reason);
    co_return Continuation();
  }
  const auto accepted = format_upgrade_response(request, json_subprotocol);
  if (co_await write_acceptance(gateway, *stream, accepted)) co_return Continuation();
  stream->put_back(unread);
  co_return serve_json_socket(gateway, connection, std::move(stream), *place);
}

/// Carries an upgrade through. The stream is used up.
rr::awaitable<Continuation> accept_websocket(GatewayState& gateway, Connection& connection,
                                             std::unique_ptr<rr::ByteStream> stream, const Request& request,
                                             rr::ByteSpan unread) {
  auto& tcp = *stream;
  connection.client = request.arrival.peer;
  connection.network = network_name(request.arrival.address);
  connection.identity = request.identity;
  const auto refuse = [&gateway, &tcp](const Response& refusal) -> rr::awaitable<void> {
    co_await write_refusal(gateway, tcp, refusal);
    co_await tcp.end(rr::no_reason);
  };
  const auto subprotocol = is_json_socket(request)   ? json_subprotocol
                           : is_page_device(request) ? page_subprotocol(request)
                                                     : rr::websocket_subprotocol;
  if (auto refusal = refuse_upgrade(request, subprotocol)) {
    gateway.reject(Rejection::bad_request);
    gateway.log_refusal(LogLevel::info, "upgrade refused", connection.client,
                        {{"peer", connection.client}, {"status", refusal->status}});
    co_await refuse(*refusal);
    co_return Continuation();
  }
  if (!connection.ticket.pass_to(request.arrival.address)) {
    gateway.reject(Rejection::too_many);
    gateway.log_refusal(LogLevel::warning, "connection refused: too many", connection.client,
                        {{"peer", connection.client}});
    const auto response = problem_response(503, "too many connections from " + connection.network);
    co_await refuse(response);
    co_return Continuation();
  }
  if (is_json_socket(request))
    co_return co_await accept_json_socket(gateway, connection, std::move(stream), request, unread);
  if (is_page_device(request))
    co_return co_await accept_page_device(gateway, connection, std::move(stream), request, unread);
  const auto destination = find_destination(gateway, request);
  if (!destination) {
    const auto& error = destination.error();
    const bool is_denied = error.code == rr::ErrorCode::permission_denied;
    gateway.reject(is_denied ? Rejection::forbidden : Rejection::no_such_device);
    const auto response =
        is_denied ? gateway.http_access().refusal(request, error)
                  : problem_response(error.code == rr::ErrorCode::node_not_found ? 404 : 400, error.message);
    co_await refuse(response);
    co_return Continuation();
  }
  const auto kept = destination->device ? destination->device->shared_from_this() : nullptr;
  std::string way(request.header(way_header));
  const bool is_circle = destination->device && destination->device->is_on_way(way);
  if (is_circle) destination->device->note_circle();
  if (is_circle || way.size() > longest_way) {
    const auto response = problem_response(508, "the way leads back to the gateway that it began at");
    co_await refuse(response);
    co_return Continuation();
  }
  const bool takes_close = takes_close_frames(request);
  // In a session of ours each request is looked at; see shared_access.hpp.
  const auto allowed = destination->node ? rr::Result<>() : may_relay(gateway, connection, destination->device);
  // Who speaks Robot Raconteur can be told so in it, and a page can read why a WebSocket closes; but to show who one
  // is, where a page or another gateway has not done so, is for the upgrade.
  const bool names_protocol = request.message.count(http::field::sec_websocket_protocol) != 0;
  const bool has_shown = request.identity.is_proven();
  const bool can_show = takes_close || !way.empty();
  const bool hears_in_session = !allowed && names_protocol && (has_shown || !can_show);
  if (!allowed && !hears_in_session && !(takes_close && has_shown)) {
    const auto response = gateway.http_access().refusal(request, allowed.error());
    co_await refuse(response);
    co_return Continuation();
  }
  if (hears_in_session || destination->node) {
    rr::NodeIdentity self;
    if (hears_in_session) {  // before the wait: the device may have gone behind it
      const bool is_stranger = !gateway.access().state().rules.sees_any(request.identity);
      const auto found = asked_node(request);
      const auto asked = found ? *found : rr::NodeIdentity();
      self = is_stranger || !destination->device ? unknown_identity(gateway, asked.id, asked.name)
                                                 : relayed_identity(gateway, *destination->device);
    }
    const auto accepted = format_upgrade_response(request);
    if (co_await write_acceptance(gateway, tcp, accepted)) co_return Continuation();
    tcp.put_back(unread);
    auto socket = std::make_unique<rr::WebSocketStream>(std::move(stream), rr::WebSocketRole::server, takes_close);
    if (hears_in_session) {
      gateway.log_refusal(LogLevel::info, "client refused", connection.client,
                          {{"peer", connection.client}, {"error", allowed.error().message}});
      auto refusal = allowed.error();
      co_return refuse_in_session(gateway, connection, std::move(self), std::move(socket), std::move(refusal));
    }
    auto base_url = node_url(request);
    co_return serve_shared_client(gateway, connection, *destination, std::move(socket), std::move(base_url));
  }
  rr::Result<std::unique_ptr<Boarding>> boarding(nullptr);
  if (allowed)
    boarding = co_await board(gateway, connection, *destination->device, std::move(way));
  else
    boarding = allowed.error();
  if (!boarding && !takes_close) {
    auto response = problem_response(503, boarding.error().message);
    response.set("Retry-After", "2");
    co_await refuse(response);
    co_return Continuation();
  }
  const auto accepted = format_upgrade_response(request);
  if (co_await write_acceptance(gateway, tcp, accepted)) co_return Continuation();
  tcp.put_back(unread);
  auto socket = std::make_unique<rr::WebSocketStream>(std::move(stream), rr::WebSocketRole::server, takes_close);
  if (!boarding) {  // a page can't read the status of a refused upgrade, but it can read why a WebSocket closes
    gateway.log_refusal(LogLevel::info, "client refused", connection.client,
                        {{"peer", connection.client}, {"error", boarding.error().message}});
    const auto code = static_cast<std::uint16_t>(allowed ? 1013 : 1008);
    const rr::EndReason reason{code, boarding.error().message};
    co_await socket->end(reason);
    co_return Continuation();
  }
  co_return relay_client(gateway, connection, std::move(socket), std::move(*boarding));
}

/// Refuses what somebody else's page has a browser send.
std::optional<Response> refuse_page(GatewayState& gateway, const Request& request) {
  const auto& config = gateway.config();
  const auto tls = gateway.tls();
  const PageRules rules{config.allowed_origins, config.allowed_hosts, tls.get()};
  auto refusal = refuse_unknown_host(request, rules);
  if (!refusal) refusal = refuse_foreign_page(request, rules);
  if (!refusal) return std::nullopt;
  gateway.reject(refusal->status == 421 ? Rejection::host : Rejection::origin);
  gateway.log_refusal(LogLevel::info, "page refused", request.arrival.peer,
                      {{"peer", request.arrival.peer},
                       {"status", refusal->status},
                       {"host", request.arrival.host},
                       {"origin", request.header(http::field::origin)}});
  return refusal;
}

/// Where TLS is required: what in clear is sent there, or refused. A client that has shown something in clear has given
/// it away, and hears so. Whether the gateway works is no secret.
std::optional<Response> require_tls(GatewayState& gateway, const Request& request) {
  const auto path = request.path();
  if (!gateway.config().tls.is_required || request.arrival.is_encrypted || path == "/healthz" || path == "/readyz")
    return std::nullopt;
  const auto method = request.message.method();
  const bool shows =
      request.message.count(http::field::authorization) != 0 || rr::query_value(request.query(), "ticket");
  const bool is_look = method == http::verb::get || method == http::verb::head;
  if (is_look && !shows && !asks_for_websocket(request) && !request.arrival.host.empty()) {
    auto response = problem_response(308, "the gateway is reached by https:// alone");
    const auto target = request.message.target();
    response.set("Location", "https://" + request.arrival.host + request.arrival.prefix +
                                 std::string(target.data(), target.size()));
    return response;
  }
  gateway.reject(Rejection::forbidden);
  gateway.log_refusal(LogLevel::info, "request in clear refused", request.arrival.peer,
                      {{"peer", request.arrival.peer}, {"path", path}});
  return problem_response(403, std::string("the gateway is reached by TLS alone: https://, wss://") +
                                   (shows ? "; what you have shown in clear may be known to others by now" : ""));
}

/// While the gateway stops, it says so, and nothing else.
bool is_answered_while_stopping(const Request& request) {
  const auto path = request.path();
  return path == "/healthz" || path == "/readyz" || path == "/metrics";
}

Response stopping_response() {
  auto response = problem_response(503, "the gateway is stopping");
  response.set("Retry-After", "5");
  response.closes = true;
  return response;
}

/// Whether it matters who asks. The page itself and how the gateway is are no secrets.
bool is_guarded(const Request& request) {
  const auto path = request.path();
  return asks_for_websocket(request) || path == "/metrics" || path == mcp_path || path.starts_with("/api/") ||
         path.starts_with(devices_prefix);
}

Face face_of(const Request& request) {
  if (asks_for_websocket(request)) return is_json_socket(request) ? Face::json : Face::websocket;
  return request.path() == mcp_path ? Face::mcp : Face::rest;
}

/// What is refused when there is no memory left; how the gateway is can be asked all the same.
bool makes_work(const Request& request) {
  return is_guarded(request) && request.path() != "/metrics";
}

/// Who goes through with a request though it be too much, or there be no memory left; empty: nobody.
std::function<bool(const Identity&)> who_passes(GatewayState& gateway, const Request& request) {
  // The rules are asked when it is known who comes: they may have been read anew by then.
  if (may_stop_something(request))
    return [&gateway](const Identity& who) { return gateway.access().state().rules.sees_any(who); };
  auto urgent = find_urgent(gateway, request);
  if (!urgent) return {};
  return [&gateway, urgent = std::move(*urgent)](const Identity& who) {
    const auto& rules = gateway.access().state().rules;
    // Which object it is the path of a URL does not tell for certain.
    if (urgent.verb == Verb::lock) return rules.extent(who, urgent.device, urgent.verb) != Extent::none;
    const AccessRequest wanted{.device = urgent.device, .service = urgent.service, .verb = urgent.verb};
    return rules.check(who, wanted).has_value();
  };
}

void note_unreadable(GatewayState& gateway, const Connection& connection, const ReadFailure& failure) {
  if (failure.status == 0) return;  // the client is gone
  gateway.reject(failure.status == 503 ? Rejection::memory : Rejection::bad_request);
  gateway.log_refusal(LogLevel::info, "request refused", connection.client,
                      {{"peer", connection.client}, {"status", failure.status}, {"detail", failure.detail}});
}

/// At its end a connection is not judged any more.
struct Unjudged {
  Connection& connection;
  ~Unjudged() { connection.is_good = nullptr; }
};

/// The page's own links are relative: they need the '/' at the end.
bool is_base_path(const Request& request, const Config& config) {
  return !config.base_path.empty() && request.path() == config.base_path;
}

Response to_base_path(const Config& config) {
  auto response = problem_response(308, "the page is at " + config.base_path + "/");
  response.set("Location", config.base_path + "/");
  return response;
}

/// Answers a request. What that takes is given back before the next one is waited for.
/// Returns  how the connection goes on; nullopt: with the next request.
rr::awaitable<std::optional<Continuation>> serve_request(GatewayState& gateway, Connection& connection,
                                                         std::unique_ptr<rr::ByteStream>& stream, RequestReader& reader,
                                                         HttpRequest&& message) {
  const auto& config = gateway.config();
  Request request{std::move(message)};
  ++gateway.metrics().requests;
  request.arrival = see_through_proxies(request, connection.peer, config.proxy.trust);
  take_base_path(request, config.base_path);
  const bool is_refused = gateway.is_stopping() && !is_answered_while_stopping(request);
  request.identity.face = face_of(request);
  HttpAccess::Admitted admitted;
  const auto passes = who_passes(gateway, request);
  admitted.refusal = refuse_page(gateway, request);
  const bool is_foreign = admitted.refusal.has_value();
  if (!admitted.refusal) admitted.refusal = require_tls(gateway, request);
  if (!admitted.refusal && !is_refused && is_guarded(request) && !is_awaited_page(gateway, request)) {
    admitted = co_await gateway.http_access().admit(request, connection, config, passes);
    if (admitted.refusal) gateway.reject(rejection_of(admitted.refusal->status));
  }
  auto memory = gateway.memory().charge(network_name(request.arrival.address));
  const bool is_urgent = passes && passes(request.identity);
  if (!admitted.refusal && !is_refused && makes_work(request) && !is_urgent && !memory.has_room(least_room))
    admitted.refusal = refuse_for_memory(&gateway.metrics());
  if (admitted.refusal && asks_for_websocket(request)) {
    co_await write_refusal(gateway, *stream, *admitted.refusal);
    co_await stream->end(rr::no_reason);
    co_return Continuation();
  }
  if (!is_refused && asks_for_websocket(request)) {
    admitted = {};  // connections have bounds of their own
    const rr::Bytes unread(reader.unread().begin(), reader.unread().end());
    co_return co_await accept_websocket(gateway, connection, std::move(stream), request, unread);
  }
  auto headers = is_foreign ? std::vector<std::pair<std::string, std::string>>() : headers_for_page(request);
  if (request.arrival.is_encrypted && config.tls.hsts_seconds > 0)
    headers.emplace_back("Strict-Transport-Security", "max-age=" + std::to_string(config.tls.hsts_seconds));
  ResponseOptions options{.closes = gateway.is_stopping(),
                          .headers = std::move(headers),
                          .cookie = [&] { return gateway.http_access().renewed_cookie(request); },
                          .patience = config.timeouts.send_stall,
                          .is_vital = !makes_work(request),
                          .is_urgent = is_urgent,
                          .metrics = &gateway.metrics()};
  ResponseWriter writer(*stream, reader, request, std::move(memory), std::move(options));
  const auto response = admitted.refusal                ? *admitted.refusal
                        : is_refused                    ? stopping_response()
                        : is_base_path(request, config) ? to_base_path(config)
                                                        : gateway.router().answer(request);
  if (response.answer_later) {
    const auto standing = std::make_shared<Standing>(gateway.access(), request.identity);
    // Streams, and requests that are not whole yet, end with what the client has shown; what is at work is answered.
    connection.is_good = [standing, &writer] {
      return writer.is_at_work() || (standing->is_good() && writer.may_go_on());
    };
    const Unjudged after{connection};
    co_await response.answer_later(writer);
    if (writer.body_failure()) note_unreadable(gateway, connection, *writer.body_failure());
  } else if (co_await writer.send(response)) {
    co_return Continuation();
  }
  if (writer.goes_on()) co_return std::nullopt;
  co_await stream->end(rr::no_reason);
  co_return Continuation();
}

/// Refuses what could not be read.
rr::awaitable<void> refuse_unreadable(GatewayState& gateway, Connection& connection, rr::ByteStream& stream,
                                      const ReadFailure& failure) {
  note_unreadable(gateway, connection, failure);
  const auto response = problem_response(failure.status, failure.detail);
  co_await write_refusal(gateway, stream, response);
  co_await stream.end(rr::no_reason);
}

}  // namespace

rr::awaitable<Continuation> serve_http_client(GatewayState& gateway, Connection& connection,
                                              std::unique_ptr<rr::ByteStream> stream) {
  const auto& limits = gateway.config().limits;
  RequestReader reader(*stream,
                       {limits.header_bytes, limits.header_timeout, gateway.config().timeouts.idle, limits.body_bytes});
  for (;;) {
    auto read = co_await reader.next();
    if (!read.request) {
      if (read.failure.status != 0) co_await refuse_unreadable(gateway, connection, *stream, read.failure);
      co_return Continuation();
    }
    auto next = co_await serve_request(gateway, connection, stream, reader, std::move(*read.request));
    if (next) co_return std::move(*next);
  }
}

}  // namespace rrgate
