#include "server/front/serve_shared_client.hpp"

#include <boost/asio/as_tuple.hpp>
#include <boost/asio/use_awaitable.hpp>

#include "core/session/service_path.hpp"
#include "server/access/replay_name.hpp"
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
/// sessions rest, waits for what will be there in a moment. Who may use nothing of a device wakes nothing; a login may.
/// Returns whether there is such a node still.
rr::awaitable<bool> wait_until_ready(GatewayState& gateway, const Destination& destination, const Identity& who,
                                     asio::any_io_executor executor) {
  const auto sees = [&](const Device& device) { return gateway.access().sees(who, device.config().name); };
  asio::steady_timer look(executor);
  const auto deadline = std::chrono::steady_clock::now() + gateway.config().timeouts.connect;
  for (;;) {
    auto& shared = gateway.shared();
    auto* device = destination.device ? shared.find(*destination.device) : nullptr;
    if (destination.device && !device) co_return false;
    // Each time: services are first known when their device has answered.
    if (!destination.device)
      shared.wake(sees);
    else if (sees(*destination.device))
      device->wake();
    const bool is_ready = device ? device->is_ready() : shared.is_ready();
    if (is_ready || gateway.is_stopping() || std::chrono::steady_clock::now() >= deadline) co_return true;
    look.expires_after(look_period);
    co_await look.async_wait(asio::as_tuple(asio::use_awaitable));
  }
}

/// What a request holds until it is answered, and is recorded with then.
struct SharedPass : rr::RequestPass {
  void handle_answer(const rr::Result<>& result) override {
    if (entry) entry->finish(result);
  }

  std::shared_ptr<const HttpAccess::Passes> rates;
  AuditEntryPtr entry;
};

bool is_command(const rr::MemberAccess& wanted) {
  return wanted.member &&
         (wanted.type == rr::EntryType::function_call_req || wanted.type == rr::EntryType::property_set_req ||
          wanted.type == rr::EntryType::wire_poke_out_value_req);
}

/// Of an emergency stop, and the like, or the end of a lease.
bool is_of_urgent_member(GatewayState& gateway, const std::string& device_name, const rr::MemberAccess& wanted) {
  if (!wanted.member) return false;
  if (device_name == gateway_device) return wanted.member->name == "release_lease";
  const auto* device = gateway.devices().find(device_name);
  return device && device->config().leases.is_urgent(std::string(wanted.path) + "." + wanted.member->name);
}

/// It passes where others are refused because there were too many.
bool is_urgent(GatewayState& gateway, const std::string& device_name, const rr::MemberAccess& wanted) {
  return is_command(wanted) && is_of_urgent_member(gateway, device_name, wanted);
}

/// See AccessRequest. Asked only where what can't be recorded is not done: packets of streams come here, too.
bool is_vital(GatewayState& gateway, const SharedNode& node, const rr::MemberAccess& wanted) {
  if (!gateway.access().state().config.audit.fails_closed) return false;
  const auto device = node.device_of(rr::first_segments(wanted.path, 1));
  if (device == gateway_device && wanted.member && wanted.member->name == "renew_lease") return true;
  return is_of_urgent_member(gateway, device, wanted);
}

/// How much a client may ask for, whoever he logs in as meanwhile.
auto make_entrance(GatewayState& gateway, const SharedNode& node, const Connection& connection,
                   std::shared_ptr<SessionRights> rights) {
  const auto memory = std::make_shared<const MemoryBudget::Charge>(gateway.memory().charge(connection.network));
  return [&gateway, &node, memory, rights = std::move(rights), network = connection.network,
          shown = connection.identity.subject()](
             const rr::MemberAccess& wanted) -> rr::Result<std::shared_ptr<rr::RequestPass>> {
    const auto device = node.device_of(rr::first_segments(wanted.path, 1));
    const bool passes = is_urgent(gateway, device, wanted);
    if (!passes && !memory->has_room(least_room))
      return rr::make_error(rr::ErrorCode::service_error, "the gateway has no memory left; try again in a moment");
    auto out = std::make_shared<SharedPass>();
    if (const auto& rates = gateway.config().rates; rates.is_bound() && !passes) {
      const auto user = wanted.user ? subject_of(*wanted.user) : Subject();
      const bool is_ours = user.kind == Subject::Kind::user;
      auto entered = gateway.http_access().enter(network, is_ours ? user : shown, device, rates);
      if (!entered) {
        gateway.reject(Rejection::rate);
        rights->record_too_much(wanted, entered.error().message);
        return entered.error();
      }
      out->rates = std::move(*entered);
    }
    out->entry = rights->begin(wanted);
    return out->entry || out->rates ? std::shared_ptr<rr::RequestPass>(std::move(out)) : nullptr;
  };
}

/// A session takes its seat at a device when it connects to a service.
class Seating {
 public:
  explicit Seating(GatewayState& gateway) : gateway_(gateway) {}

  /// Errors   connection_error: the device is full.
  rr::Result<> sit_down(const std::string& device_name) {
    auto* device = gateway_.devices().find(device_name);
    if (seat_ || !device) return {};
    if (auto taken = device->take_seat()) {
      seat_.emplace(std::move(*taken));
      return {};
    }
    gateway_.reject(Rejection::device_full);
    return rr::make_error(rr::ErrorCode::connection_error, device->full_text());
  }
  void get_up() { seat_.reset(); }

  /// Whose seat it is.
  std::weak_ptr<SharedClient> session;

 private:
  GatewayState& gateway_;
  std::optional<Device::Seat> seat_;
};

/// Another gateway shows its clients that a device is away only where it gets no session itself: others are let in, and
/// wait. Who may see nothing of a device is told nothing by the index of its node.
/// `device_of_node`  empty: the gateway's own node. Errors   connection_error: the device is away.
rr::Result<> check_presence(GatewayState& gateway, const SharedNode& node, const std::string& device_of_node,
                            const Identity& who, std::string_view service) {
  if (const auto shared = node.find_service(service)) {
    const auto& session = *shared->upstream();
    if (!session.is_lost()) return {};
    if (session.device().state() != DeviceState::online) return session.device().away_error();
    // One that rests, or is being opened, tells its clients if it can't be.
    if (session.is_resting() || session.is_attempting() || !session.has_tried()) return {};
    return session.lost_error();
  }
  const auto* device = gateway.devices().find(device_of_node);
  const bool is_away = device && device->state() != DeviceState::online;
  return is_away && gateway.access().sees(who, device_of_node) ? rr::Result<>(device->away_error()) : rr::Result<>();
}

/// What a session asks before it does anything, or tells of anything.
auto make_admission(GatewayState& gateway, const SharedNode& node, std::string device_of_node,
                    const Connection& connection, std::shared_ptr<SessionRights> rights,
                    std::shared_ptr<Seating> seating) {
  return [&gateway, &node, device_of_node = std::move(device_of_node), peer = connection.client,
          who = connection.identity, rights = std::move(rights),
          seating = std::move(seating)](const rr::MemberAccess& wanted) -> rr::Result<> {
    const bool connects =
        wanted.type == rr::EntryType::connect_client || wanted.type == rr::EntryType::connect_client_combined;
    auto allowed = rights->admit(wanted, is_vital(gateway, node, wanted));
    if (!connects) return allowed;
    if (!allowed) gateway.reject(allowed.error());
    if (const auto session = seating->session.lock(); allowed && session && session->is_gateway())
      allowed = check_presence(gateway, node, device_of_node, who, wanted.path);
    if (allowed) allowed = seating->sit_down(node.device_of(wanted.path));
    if (!allowed)
      gateway.log_refusal(LogLevel::info, "client refused", peer, {{"peer", peer}, {"error", allowed.error().message}});
    return allowed;
  };
}

/// A service is offered once its device has let the gateway in. Until then clients hear why it does not; on the
/// gateway's own node, of devices that they may know of.
auto explain_missing(GatewayState& gateway, const Connection& connection, const std::string& device_of_node) {
  return [&gateway, who = connection.identity, device_of_node](std::string_view service) -> std::optional<rr::Error> {
    for (const auto& device : gateway.devices().all()) {
      const auto& name = device->config().name;
      const bool is_meant =
          device_of_node.empty() ? !is_replay(name) && gateway.access().sees(who, name) : name == device_of_node;
      if (!is_meant || !device->is_shared()) continue;
      const auto session = device->find_shared(std::string(service));
      if (auto failure = session ? (*session)->failure() : std::nullopt) return failure;
      const bool is_away = !session && session.error().code == rr::ErrorCode::connection_error;
      if (is_away && !device_of_node.empty()) return session.error();
    }
    return std::nullopt;
  };
}

/// Whoever waits for the end of the session is woken by `ended`.
std::shared_ptr<SharedClient> begin_session(GatewayState& gateway, Connection& connection, Destination destination,
                                            std::unique_ptr<rr::ByteStream> client, std::string base_url,
                                            const std::shared_ptr<Seating>& seating, std::function<void()> ended) {
  const auto device = destination.device ? destination.device->config().name : std::string();
  const auto shown = std::make_shared<Standing>(gateway.access(), connection.identity);
  const auto rights = std::make_shared<SessionRights>(gateway.access(), *destination.node, device, shown);
  SharedArrival arrival{.from = {connection.client, connection.network, connection.identity.face},
                        .base_url = std::move(base_url),
                        .admit = make_admission(gateway, *destination.node, device, connection, rights, seating),
                        .enter = make_entrance(gateway, *destination.node, connection, rights),
                        .why_missing = explain_missing(gateway, connection, device),
                        .lock_rights = rights,
                        .is_encrypted = connection.peer.is_encrypted,
                        .memory = gateway.memory().charge(connection.network)};
  auto session = destination.node->add(std::move(client), std::move(arrival), std::move(ended));
  seating->session = session;
  connection.device = destination.device ? destination.device->shared_from_this() : nullptr;
  connection.has_session = true;
  connection.is_good = [rights, session] {
    if (!rights->is_good()) return false;
    if (rights->have_changed(session->session().user())) session->review();
    return true;
  };
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
  const auto executor = client->executor();
  if (!co_await wait_until_ready(gateway, destination, connection.identity, executor)) {
    client->close();
    co_return;
  }
  const auto name = destination.device ? destination.device->config().name : std::string("the gateway");
  log(LogLevel::info, "client connected", {{"device", name}, {"peer", connection.client}, {"mode", "shared"}});
  SessionEnd end(executor);
  const auto seating = std::make_shared<Seating>(gateway);
  const auto session = begin_session(gateway, connection, destination, std::move(client), std::move(base_url), seating,
                                     [&end] { end.reach(); });
  co_await end.wait();
  seating->get_up();
  connection.device = nullptr;
  connection.has_session = false;
  connection.is_good = nullptr;
  connection.stop = [](const rr::EndReason&) {};
  log(LogLevel::info, "client disconnected",
      {{"device", name}, {"peer", connection.client}, {"reason", end_reason(*session)}});
}

}  // namespace rrgate
