// Services of shared devices on the gateway's own node, where one name is one service's.
#include "server/rr/shared_devices.hpp"

#include <boost/asio/io_context.hpp>
#include <catch2/catch.hpp>
#include <functional>
#include <list>
#include <set>

#include "core/support/random.hpp"
#include "node/service/node.hpp"

using namespace rrgate;
using namespace std::chrono_literals;

namespace {

/// Devices, all on one loop of the test, and the gateway that shares them.
struct SharingBench {
  boost::asio::io_context io{1};
  std::list<rr::Node> nodes;
  Config config;
  Access access{config.access};
  Logins logins{io.get_executor(), access};
  std::optional<DeviceRegistry> registry;
  std::optional<SharedDevices> shared;

  SharingBench() { config.retry = {50ms, 100ms, 50ms}; }
  ~SharingBench() {
    shared.reset();
    if (registry) registry->stop();
    for (auto& node : nodes) node.stop();
    io.restart();
    io.run_for(2s);
  }
  SharingBench(const SharingBench&) = delete;
  SharingBench& operator=(const SharingBench&) = delete;

  /// A node with one service. `port`  0: any that is free.
  std::uint16_t start_node(const std::string& service, std::uint16_t port = 0) {
    auto& node = nodes.emplace_back(io, "test.device");
    node.add(rr::Service::from_text({"service test.empty\nobject Empty\nend\n"}, service, "Empty"));
    return node.listen("rr+tcp://127.0.0.1:" + std::to_string(port));
  }
  void add_device(const std::string& name, std::uint16_t port) {
    DeviceConfig device;
    device.name = name;
    device.mode = DeviceMode::shared;
    device.url = rr::parse_url("rr+tcp://127.0.0.1:" + std::to_string(port) + "/?service=twin").value();
    config.devices.push_back(std::move(device));
  }
  void start() {
    registry.emplace(io.get_executor(), config);
    shared.emplace(rr::random_node_id(), config, logins);
    registry->start();
    shared->sync(*registry);
  }
  /// Whether it came to that within ten seconds.
  bool run_until(const std::function<bool()>& is_so) {
    const auto end = std::chrono::steady_clock::now() + 10s;
    while (!is_so() && std::chrono::steady_clock::now() < end) {
      io.restart();
      io.run_one_for(50ms);
    }
    return is_so();
  }
  /// Devices that offer a service of this name on nodes of their own.
  std::set<std::string> devices_with(const std::string& service) const {
    std::set<std::string> out;
    for (const auto& [key, device] : shared->all())
      if (!device->node().device_of(service).empty()) out.insert(device->device()->config().name);
    return out;
  }
  std::string owner_of(const std::string& service) { return shared->node().device_of(service); }
};

/// Two devices with a service of the same name; returns whose it is on the gateway's node.
std::string start_twins(SharingBench& bench) {
  bench.add_device("left", bench.start_node("twin"));
  bench.add_device("right", bench.start_node("twin"));
  bench.start();
  REQUIRE(bench.run_until([&] { return bench.devices_with("twin").size() == 2; }));
  return bench.owner_of("twin");
}

}  // namespace

TEST_CASE("a service whose name another device had is offered when that device leaves the configuration") {
  SharingBench bench;
  const auto first = start_twins(bench);
  const std::string second = first == "left" ? "right" : "left";
  REQUIRE_FALSE(first.empty());
  auto next = bench.config;
  std::erase_if(next.devices, [&](const auto& device) { return device.name == first; });
  auto prepared = bench.registry->prepare(next);
  REQUIRE(prepared.has_value());
  bench.config = next;
  bench.registry->replace(std::move(*prepared));
  bench.shared->sync(*bench.registry);
  CHECK(bench.owner_of("twin") == second);
}

TEST_CASE("a service whose name another device had is offered when that device has it no more") {
  SharingBench bench;
  const auto first = start_twins(bench);
  const std::string second = first == "left" ? "right" : "left";
  auto& device = *bench.shared->find(*bench.registry->find(first))->device();
  auto& node = first == "left" ? bench.nodes.front() : bench.nodes.back();
  const auto port = device.config().url.port;
  node.stop();
  REQUIRE(bench.run_until([&] { return device.state() == DeviceState::offline; }));
  CHECK(bench.owner_of("twin") == first);  // it may come back
  bench.start_node("other", port);
  REQUIRE(bench.run_until([&] { return bench.owner_of("other") == first; }));
  CHECK(bench.owner_of("twin") == second);
}
