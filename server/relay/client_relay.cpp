#include "server/relay/client_relay.hpp"

#include "server/access/standing.hpp"
#include "server/log/log.hpp"
#include "server/relay/relay.hpp"

namespace rrgate {

rr::Result<> may_relay(GatewayState& gateway, const Connection& connection, const Device* device) {
  auto& access = gateway.access();
  const auto& who = connection.identity;
  auto allowed = access.check_whole_device(who, device ? device->config().name : std::string());
  if (allowed) return allowed;
  gateway.reject(allowed.error());
  const auto& rules = access.state().rules;
  return rules.sees_any(who) ? allowed : rules.check_whole_device(who, {});
}

rr::awaitable<rr::Result<std::unique_ptr<Boarding>>> board(GatewayState& gateway, const Connection& connection,
                                                           Device& device, std::string way) {
  const auto entry =
      gateway.access().begin(connection.identity, {.device = device.config().name, .verb = Verb::call}, {}, "relay");
  const auto refused = [&entry](rr::Error error) {
    if (entry) entry->finish(error);
    return error;
  };
  auto seat = device.take_seat();
  if (!seat) {
    gateway.reject(Rejection::device_full);
    co_return refused(rr::make_error(rr::ErrorCode::connection_error, device.full_text()));
  }
  auto stream = co_await device.connect(std::move(way));
  if (!stream) {
    gateway.reject(Rejection::device_offline);
    co_return refused(rr::make_error(rr::ErrorCode::connection_error, device.offline_text(stream.error())));
  }
  if (entry) entry->finish({});
  auto boarding = std::make_unique<Boarding>(Boarding{device, std::move(*seat), std::move(*stream)});
  co_return boarding;
}

rr::awaitable<void> relay_client(GatewayState& gateway, Connection& connection, std::unique_ptr<rr::ByteStream> client,
                                 std::unique_ptr<Boarding> boarding) {
  auto& device = boarding->device;
  const auto& limits = gateway.config().limits;
  const RelayOptions options{.max_message_size = limits.max_message_size,
                             .outbox_bytes = limits.outbox_bytes,
                             .opaque_rate = limits.opaque_rate};
  Relay relay(*client, *boarding->stream, options, device.traffic(), gateway.memory().charge(connection.network));
  connection.device = device.shared_from_this();
  connection.has_session = true;
  connection.stop = [&relay](rr::EndReason reason) { relay.stop(std::move(reason)); };
  const auto standing = std::make_shared<Standing>(gateway.access(), connection.identity);
  const auto& name = device.config().name;
  connection.is_good = [standing, &access = gateway.access(), name] {
    return standing->is_good() && access.state().rules.check_whole_device(standing->identity(), name);
  };
  log(LogLevel::info, "client connected", {{"device", name}, {"peer", connection.client}});

  const auto reason = co_await relay.run();

  connection.device = nullptr;
  connection.has_session = false;
  connection.is_good = nullptr;
  connection.stop = [](const rr::EndReason&) {};
  // A device that ends a connection may be ending altogether: find out now rather than at the next look.
  if (!gateway.is_stopping() && (reason.code == 1011 || reason.text.rfind("device", 0) == 0)) device.note_trouble();
  log(LogLevel::info, "client disconnected",
      {{"device", name},
       {"peer", connection.client},
       {"reason", reason.text},
       {"bytes_to_device", relay.bytes_to_device()},
       {"bytes_to_client", relay.bytes_to_client()}});
}

}  // namespace rrgate
