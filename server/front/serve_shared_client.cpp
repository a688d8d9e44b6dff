#include "server/front/serve_shared_client.hpp"

#include <boost/asio/as_tuple.hpp>
#include <boost/asio/use_awaitable.hpp>

#include "server/front/refused_client.hpp"
#include "server/front/session_end.hpp"
#include "server/log/log.hpp"
#include "server/rr/shared_access.hpp"
#include "server/state/http_access.hpp"

namespace rrgate {

namespace asio = boost::asio;

Destination destination_of(GatewayState& gateway, Device& device) {
  auto* shared = gateway.shared().find(device);
  return {&device, shared ? &shared->node() : nullptr};
}

std::optional<Destination> find_destination(GatewayState& gateway, const rr::NodeId& node_id,
                                            std::string_view node_name) {
  auto& own = gateway.shared().node();
  if (auto* shared = gateway.shared().find(node_id, node_name))
    return Destination{shared->device().get(), &shared->node()};
  const bool asks_for_none = node_id.is_any() && node_name.empty();
  const bool asks_for_us =
      (node_id.is_any() || node_id == own.identity().id) && (node_name.empty() || node_name == own.identity().name);
  if (asks_for_us && !asks_for_none) return Destination{nullptr, &own};
  auto* device = gateway.devices().route(node_id, node_name);
  if (device && !device->is_shared()) return Destination{device, nullptr};
  if (asks_for_none) return Destination{nullptr, &own};
  return std::nullopt;
}

namespace {

constexpr std::chrono::milliseconds look_period{10};

/// Whoever comes when the gateway has just begun, as clients do that its restart has cut off, or to a device whose
/// sessions rest, waits for what will be there in a moment. Returns whether there is such a node still.
rr::awaitable<bool> wait_until_ready(GatewayState& gateway, const Destination& destination,
                                     asio::any_io_executor executor) {
  if (!destination.device) gateway.shared().wake();
  asio::steady_timer look(executor);
  const auto deadline = std::chrono::steady_clock::now() + gateway.config().timeouts.connect;
  for (;;) {
    auto& shared = gateway.shared();
    auto* device = destination.device ? shared.find(*destination.device) : nullptr;
    if (destination.device && !device) co_return false;
    if (device) device->wake();
    const bool is_ready = device ? device->is_ready() : shared.is_ready();
    if (is_ready || gateway.is_stopping() || std::chrono::steady_clock::now() >= deadline) co_return true;
    look.expires_after(look_period);
    co_await look.async_wait(asio::as_tuple(asio::use_awaitable));
  }
}

/// How much a client may ask for, whoever he logs in as meanwhile.
auto make_rate_gate(GatewayState& gateway, const SharedNode& node, const Connection& connection) {
  const auto& identity = connection.identity;
  const auto memory = std::make_shared<const MemoryBudget::Charge>(gateway.memory().charge(connection.address));
  return [&gateway, &node, memory, address = connection.address,
          shown = identity.is_proven() ? identity.name : std::string()](
             const rr::MemberAccess& wanted) -> rr::Result<std::shared_ptr<const void>> {
    if (!memory->has_room(least_room))
      return rr::make_error(rr::ErrorCode::service_error, "the gateway has no memory left; try again in a moment");
    const auto& rates = gateway.config().rates;
    if (!rates.is_bound()) return std::shared_ptr<const void>();
    const bool is_ours = wanted.user && gateway.access().authenticator();  // else it is a user of the device's
    const auto device = node.device_of(wanted.path.substr(0, wanted.path.find('.')));
    auto passes = gateway.http_access().enter(address, is_ours ? wanted.user->name : shown, device, rates);
    if (passes) return std::shared_ptr<const void>(std::move(*passes));
    gateway.reject(Rejection::rate);
    return passes.error();
  };
}

/// Whoever waits for the end of the session is woken by `ended`.
std::shared_ptr<SharedClient> begin_session(GatewayState& gateway, Connection& connection, Destination destination,
                                            std::unique_ptr<rr::ByteStream> client, std::string base_url,
                                            std::function<void()> ended) {
  SharedArrival arrival{.peer = connection.client,
                        .base_url = std::move(base_url),
                        .admit = make_admission(gateway.access(), *destination.node, connection.identity),
                        .enter = make_rate_gate(gateway, *destination.node, connection),
                        .is_encrypted = connection.peer.is_encrypted,
                        .memory = gateway.memory().charge(connection.address)};
  auto session = destination.node->add(std::move(client), std::move(arrival), std::move(ended));
  connection.device = destination.device;
  connection.has_session = true;
  connection.stop = [session](const rr::EndReason& reason) {
    session->close_service();
    session->close(rr::make_error(rr::ErrorCode::connection_error, reason.text));
  };
  return session;
}

std::string end_reason(const SharedClient& session) {
  return session.end_reason().empty() ? session.session().connection().close_reason().message : session.end_reason();
}

}  // namespace

rr::awaitable<void> serve_shared_client(GatewayState& gateway, Connection& connection, Destination destination,
                                        std::unique_ptr<rr::ByteStream> client, std::string base_url) {
  std::optional<Device::Seat> seat;
  if (destination.device) {
    if (auto taken = destination.device->take_seat()) {
      seat.emplace(std::move(*taken));
    } else {
      gateway.reject(Rejection::device_full);
      auto full = rr::make_error(rr::ErrorCode::connection_error, destination.device->full_text());
      log(LogLevel::info, "client refused", {{"peer", connection.client}, {"error", full.message}});
      auto self = destination.node->identity();
      co_await refuse_in_session(gateway, connection, std::move(self), std::move(client), std::move(full));
      co_return;
    }
  }
  const auto executor = client->executor();
  if (!co_await wait_until_ready(gateway, destination, executor)) {
    client->close();
    co_return;
  }
  const auto name = destination.device ? destination.device->config().name : std::string("the gateway");
  log(LogLevel::info, "client connected", {{"device", name}, {"peer", connection.client}, {"mode", "shared"}});
  SessionEnd end(executor);
  const auto session =
      begin_session(gateway, connection, destination, std::move(client), std::move(base_url), [&end] { end.reach(); });
  co_await end.wait();
  connection.device = nullptr;
  connection.has_session = false;
  connection.stop = [](const rr::EndReason&) {};
  log(LogLevel::info, "client disconnected",
      {{"device", name}, {"peer", connection.client}, {"reason", end_reason(*session)}});
}

}  // namespace rrgate
