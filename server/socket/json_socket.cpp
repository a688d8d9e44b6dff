#include "server/socket/json_socket.hpp"

#include "server/http/endpoints/call_log.hpp"
#include "server/socket/json_operations.hpp"
#include "server/socket/message_socket.hpp"

namespace rrgate {

namespace {

constexpr std::string_view objects_prefix = "/api/v1/devices/";

}  // namespace

bool is_json_socket(const Request& request) {
  return request.path().substr(0, objects_prefix.size()) == objects_prefix;
}

rr::Result<std::shared_ptr<JsonSocketPlace>> find_json_socket(GatewayState& gateway, const Request& request) {
  auto segments = split_path(request.path().substr(objects_prefix.size()));
  if (!segments) return segments.error();
  if (segments->size() < 2)
    return rr::make_error(rr::ErrorCode::object_not_found, "expected /api/v1/devices/DEVICE/SERVICE");
  // What is done to which member is judged when it is asked for.
  const AccessRequest wanted{.device = segments->front(), .service = (*segments)[1]};
  if (const auto allowed = gateway.access().check(request.identity, wanted); !allowed) return allowed.error();
  auto* device = gateway.devices().find(segments->front());
  if (!device)
    return rr::make_error(rr::ErrorCode::node_not_found,
                          "no device " + rr::quote(segments->front()) + "; /api/v1/devices lists them");
  auto place = std::make_shared<JsonSocketPlace>();
  place->device = device->shared_from_this();
  place->standing = std::make_shared<Standing>(gateway.access(), request.identity);
  place->from = request.origin();
  auto key = session_key(gateway, request, (*segments)[1]);
  if (!key) return key.error();
  place->key = std::move(*key);
  place->segments.assign(segments->begin() + 2, segments->end());
  place->form = json_form(request);
  place->trace = trace_id_of(request.header("traceparent"));
  return place;
}

rr::awaitable<void> serve_json_socket(GatewayState& gateway, Connection& connection,
                                      std::unique_ptr<rr::ByteStream> stream, std::shared_ptr<JsonSocketPlace> place) {
  const auto socket = std::make_shared<MessageSocket>(std::move(stream), gateway.config().limits.body_bytes,
                                                      gateway.memory().charge(place->from.network));
  const auto operations = std::make_shared<JsonOperations>(gateway, *place, socket->outbox());
  const auto device = place->device->config().name;
  connection.device = place->device;
  connection.stop = [socket](rr::EndReason reason) { socket->stop(std::move(reason)); };
  connection.is_good = [standing = place->standing, operations] {
    operations->review();  // ends what the client has no right to any more
    return standing->is_good();
  };
  log(LogLevel::info, "client connected", {{"device", device}, {"peer", connection.client}, {"as", "json"}});

  // g++ 12 destroys functions twice where they are made within an expression that waits.
  std::function<rr::awaitable<void>(const std::string&)> take = [operations](const std::string& message) {
    return operations->take(message);
  };
  std::function<void()> stopped = [operations] { operations->stop(); };
  const auto reason = co_await socket->run(std::move(take), std::move(stopped));

  connection.device = nullptr;
  connection.is_good = nullptr;
  connection.stop = [](const rr::EndReason&) {};
  log(LogLevel::info, "client disconnected", {{"device", device}, {"peer", connection.client}, {"reason", reason}});
}

}  // namespace rrgate
