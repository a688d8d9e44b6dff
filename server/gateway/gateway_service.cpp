#include "server/gateway/gateway_service.hpp"

#include <algorithm>

#include "server/config/version.hpp"
#include "server/gateway/robdef_text.hpp"
#include "server/log/log.hpp"
#include "server/state/gateway_state.hpp"
#include "server/upstream/service_locks.hpp"

namespace rrgate {

namespace asio = boost::asio;

namespace {

constexpr std::chrono::seconds device_look_period{1};

rr::NodeOptions node_options() {
  rr::NodeOptions options;
  options.report = [](const std::string& problem) { log(LogLevel::error, problem, {}); };
  return options;
}

DeviceConfig device_config(const rr::Node& node) {
  DeviceConfig config;
  config.name = GatewayService::name;
  config.url.scheme = "rr+intra";
  config.url.node_id = node.identity().id;
  config.mode = DeviceMode::shared;
  return config;
}

std::string to_string(HeldLock::Kind kind) {
  return kind == HeldLock::Kind::user ? "user" : kind == HeldLock::Kind::client ? "client" : "monitor";
}

/// In ms, from now.
std::uint32_t left_until(rr::TimePoint deadline) {
  const auto left = std::chrono::ceil<std::chrono::milliseconds>(deadline - std::chrono::steady_clock::now());
  return static_cast<std::uint32_t>(std::max(left, std::chrono::milliseconds{0}).count());
}

rr::Value describe(const std::string& device, const LeaseNews& news) {
  return rr::Structure{"org.rrgate.gateway.Lease",
                       {{"device", device},
                        {"service_name", news.service},
                        {"path", news.lease.path},
                        {"user", news.lease.by.name},
                        {"deadman", static_cast<std::uint32_t>(news.lease.deadman.count())},
                        {"left", news.is_held ? left_until(news.lease.deadline) : 0U},
                        {"held", news.is_held},
                        {"reason", news.why}}};
}

rr::Value describe(const DeviceService& service) {
  rr::List implements;
  for (const auto& type : service.implements) implements.items.emplace_back(type);
  return rr::Structure{
      "org.rrgate.gateway.DeviceService",
      {{"name", service.name}, {"root_object_type", service.type}, {"root_object_implements", std::move(implements)}}};
}

double seconds(std::chrono::microseconds time) {
  return std::chrono::duration<double>(time).count();
}

}  // namespace

GatewayService::GatewayService(asio::io_context& io, GatewayState& gateway)
    : gateway_(gateway),
      node_(io, "", node_options()),
      service_(rr::Service::from_text({std::string(robdef_gateway)}, std::string(name), "Gateway")),
      device_(std::make_shared<Device>(io.get_executor(), device_config(node_), gateway.config())) {
  add_members();
}

void GatewayService::add_members() {
  service_->property("version").get([] { return std::string(version); });
  service_->property("uptime").get(
      [this] { return std::chrono::duration<double>(std::chrono::steady_clock::now() - begun_).count(); });
  service_->property("devices").get([this] { return list_devices(); });
  service_->property("subscriptions").get([this] { return list_subscriptions(); });
  service_->property("locks").get([this] { return list_locks(); });
  add_leases();
  service_->on_client_connected([this](rr::ClientId) { show_statistics(); });  // made for clients alone
  service_->function("find_device", [this](const std::string& wanted) {
    const auto* device = gateway_.devices().find(wanted);
    if (!device) throw rr::Exception(rr::make_error(rr::ErrorCode::key_not_found, "no device " + rr::quote(wanted)));
    return describe(*device);
  });
}

void GatewayService::add_leases() {
  using rr::LockCommand;
  service_->property("leases").get([this] { return list_leases(); });
  service_->function("acquire_lease",
                     [this](const std::string& session, const std::string& path, std::uint32_t deadman) {
                       ask_for_lease(LockCommand::acquire_lease, session, path, deadman);
                     });
  service_->function("take_lease", [this](const std::string& session, const std::string& path, std::uint32_t deadman) {
    ask_for_lease(LockCommand::take_lease, session, path, deadman);
  });
  service_->function("renew_lease", [this](const std::string& session, const std::string& path) {
    ask_for_lease(LockCommand::renew_lease, session, path, 0);
  });
  service_->function("release_lease", [this](const std::string& session, const std::string& path) {
    ask_for_lease(LockCommand::release_lease, session, path, 0);
  });
}

/// Leases are decided at once: nothing of it waits for the device.
void GatewayService::ask_for_lease(rr::LockCommand command, const std::string& session, const std::string& path,
                                   std::uint32_t deadman) {
  const auto client = gateway_.shared().find_client(session);
  if (!client)
    throw rr::Exception(rr::make_error(rr::ErrorCode::key_not_found,
                                       "no session of a shared device has this attribute \"rrgate.session\""));
  rr::Result<> result = rr::make_error(rr::ErrorCode::connection_error, "the session has ended");
  client->ask_for_lease(command, path, std::chrono::milliseconds(deadman),
                        [&result](const rr::Result<>& answer) { result = answer; });
  if (!result) throw rr::Exception(result.error());
}

void GatewayService::start() {
  node_.add(service_);
  node_.listen("rr+intra:///");
  look_at_devices();
  node_.every(device_look_period, [this] { look_at_devices(); });
  device_->start();
}

void GatewayService::stop() {
  for (const auto& device : gateway_.devices().all()) device->on_lease(nullptr);
  device_->stop();
  node_.stop();
}

void GatewayService::look_soon() {
  if (std::exchange(looks_soon_, true)) return;
  node_.post([this] {
    looks_soon_ = false;
    look_at_devices();
  });
}

void GatewayService::look_at_devices() {
  auto before = std::exchange(known_, {});
  for (const auto& device : gateway_.devices().all()) {
    const auto& device_name = device->config().name;
    known_[device_name] = device->state();
    device->on_lease([this, device_name](const LeaseNews& news) {
      service_->fire("lease_changed", rrgate::describe(device_name, news));
    });
    const auto known = before.extract(device_name);
    if (!known || known.mapped() != device->state()) service_->fire("device_changed", describe(*device));
  }
  for (const auto& [device_name, state] : before) service_->fire("device_removed", device_name);
  if (node_.client_count() > 0) show_statistics();
}

void GatewayService::show_statistics() {
  service_->set_wire("statistics", list_statistics());
}

rr::Value GatewayService::describe(const Device& device) const {
  std::string node_name;
  std::vector<std::uint8_t> node_id;
  rr::List services;
  if (const auto& identity = device.identity()) {
    node_name = identity->node_name;
    node_id.assign(identity->node_id.bytes.begin(), identity->node_id.bytes.end());
    for (const auto& service : identity->services) services.items.push_back(rrgate::describe(service));
  }
  return rr::Structure{"org.rrgate.gateway.Device",
                       {{"name", device.config().name},
                        {"state", std::string(to_string(device.state()))},
                        {"mode", device.is_shared() ? "shared" : "relay"},
                        {"last_error", device.last_error()},
                        {"node_name", node_name},
                        {"node_id", rr::Value(std::move(node_id))},
                        {"services", std::move(services)},
                        {"clients", static_cast<std::uint32_t>(device.clients())},
                        {"found", device.config().is_found}}};
}

rr::Value GatewayService::list_devices() const {
  rr::List out;
  for (const auto& device : gateway_.devices().all()) out.items.push_back(describe(*device));
  return out;
}

rr::Value GatewayService::list_statistics() const {
  rr::List out;
  for (const auto& device : gateway_.devices().all()) {
    const auto traffic = gateway_.shared().traffic_of(*device);
    out.items.push_back(rr::Structure{"org.rrgate.gateway.DeviceStatistics",
                                      {{"device", device->config().name},
                                       {"sessions", traffic.sessions},
                                       {"messages_to_device", traffic.to_device.messages},
                                       {"messages_to_clients", traffic.to_clients.messages},
                                       {"bytes_to_device", traffic.to_device.bytes},
                                       {"bytes_to_clients", traffic.to_clients.bytes}}});
  }
  return out;
}

rr::Value GatewayService::list_subscriptions() const {
  rr::List out;
  const bool shows_clients = gateway_.access().is_open();  // nobody knows here who asks
  gateway_.shared().visit_ledgers([&](const SharedDevice& device, const SharedClient& client, const std::string& path,
                                      const rr::MemberDefinition& member, const rr::Ledger& ledger) {
    out.items.push_back(rr::Structure{"org.rrgate.gateway.Subscription",
                                      {{"device", device.device()->config().name},
                                       {"service_name", client.service() ? client.service()->name() : std::string()},
                                       {"client", shows_clients ? client.peer() : std::string()},
                                       {"path", path},
                                       {"member", member.name},
                                       {"kind", member.kind == rr::MemberKind::wire ? "wire" : "pipe"},
                                       {"delivered", ledger.delivered},
                                       {"conflated", ledger.conflated},
                                       {"dropped", ledger.dropped},
                                       {"age_p50", seconds(ledger.ages.quantile(0.5))},
                                       {"age_p99", seconds(ledger.ages.quantile(0.99))}}});
  });
  return out;
}

rr::Value GatewayService::list_leases() const {
  rr::List out;
  for (const auto& device : gateway_.devices().all())
    for (const auto& [service, locks] : device->locks())
      for (auto& lease : locks->leases())
        out.items.push_back(rrgate::describe(device->config().name, {service, std::move(lease), true, {}}));
  return out;
}

rr::Value GatewayService::list_locks() const {
  rr::List out;
  for (const auto& device : gateway_.devices().all())
    for (const auto& [service, locks] : device->locks())
      for (auto& lock : locks->held())
        out.items.push_back(rr::Structure{"org.rrgate.gateway.Lock",
                                          {{"device", device->config().name},
                                           {"service_name", service},
                                           {"path", std::move(lock.path)},
                                           {"kind", to_string(lock.kind)},
                                           {"user", std::move(lock.by.name)}}});
  return out;
}

}  // namespace rrgate
