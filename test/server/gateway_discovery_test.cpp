// Found nodes as devices of the gateway. Announcements are handed in; the nodes are real, on the loopback.
#include <boost/asio/ip/tcp.hpp>
#include <catch2/catch.hpp>

#include "test/node/node/node_fixture.hpp"
#include "test/node/transport/certificate_lab.hpp"
#include "test/server/support/test_gateway.hpp"

using namespace rrgate;
using namespace rrgate::test;
using nlohmann::json;

namespace {

std::function<void(Config&)> allowing(std::vector<DiscoverRule> rules, std::size_t max_devices = 64) {
  return [rules = std::move(rules), max_devices](Config& config) {
    config.discover = {true, {}, rules, max_devices, false, false};  // no scopes: no packets
  };
}

rr::Announcement at(const rr::NodeId& id, std::uint16_t port, const std::string& name, const std::string& nonce = "n") {
  return {id, name,
          "rr+tcp://127.0.0.1:" + std::to_string(port) +
              "/?nodeid=" + rr::format_node_id(id, rr::NodeIdFormat::dashes) + "&service=RobotRaconteurServiceIndex",
          nonce};
}

std::shared_ptr<rr::Service> make_thing() {
  auto service = rr::Service::from_text(
      {"service com.x\nobject Base\nend\nobject Arm\nimplements Base\nproperty int32 one [readonly]\nend\n"}, "thing",
      "Arm");
  service->property("one").get([] { return 1; });
  return service;
}

rr::NodeId id_of(rr::RunningNode& node) {
  return node.ask([](rr::Node& asked) { return asked.identity().id; });
}

json wait_for_devices(TestGateway& gateway, const std::function<bool(const json&)>& is_wanted) {
  return gateway.wait_for("/api/v1/devices", [&](const json& all) { return is_wanted(all["devices"]); })["devices"];
}

json wait_for_nodes(TestGateway& gateway, const std::function<bool(const json&)>& is_wanted) {
  return gateway.wait_for("/api/v1/discovery", [&](const json& all) { return is_wanted(all["nodes"]); })["nodes"];
}

/// Listens, and knows whether somebody has connected.
struct Trap {
  boost::asio::io_context io;
  boost::asio::ip::tcp::acceptor acceptor{io, {boost::asio::ip::address_v4::loopback(), 0}};
  std::uint16_t port() const { return acceptor.local_endpoint().port(); }
  bool was_touched() {
    acceptor.non_blocking(true);
    boost::system::error_code error;
    boost::asio::ip::tcp::socket socket(io);
    acceptor.accept(socket, error);
    return !error;
  }
};

}  // namespace

TEST_CASE("without \"discover\" nothing is found") {
  TestGateway gateway;
  const auto answer = gateway.wait_for("/api/v1/discovery", [](const json&) { return true; });
  CHECK(answer == json::parse(R"({"enabled": false, "nodes": []})"));
}

TEST_CASE("an allowed node becomes a device, others are listed and left alone") {
  rr::RunningNode node([](rr::Node& made) { made.add(make_thing()); });
  Trap trap;
  TestGateway gateway(1, allowing({{"test.*", {}, ""}}));
  gateway.announce(at(rr::NodeId{{7}}, trap.port(), "stranger"));
  gateway.announce(at(id_of(node), node.port(), "test.node"));
  const auto devices =
      wait_for_devices(gateway, [](const json& all) { return all.size() == 2 && all[1]["state"] == "online"; });
  CHECK(devices[0]["found"] == false);
  CHECK(devices[1]["found"] == true);
  CHECK(devices[1]["name"] == "test.node");
  CHECK(devices[1]["services"][0] ==
        json::parse(R"({"name": "thing", "type": "com.x.Arm", "implements": ["com.x.Base"]})"));

  const auto nodes = wait_for_nodes(gateway, [](const json& all) { return all.size() == 2; });
  const auto& stranger = nodes[nodes[0]["node_name"] == "stranger" ? 0 : 1];
  const auto& allowed = nodes[nodes[0]["node_name"] == "stranger" ? 1 : 0];
  CHECK(stranger["allowed"] == false);
  CHECK(stranger["device"].is_null());
  CHECK(stranger["services"].is_null());
  CHECK(allowed["allowed"] == true);
  CHECK(allowed["device"] == "test.node");
  CHECK(allowed["services"][0] == devices[1]["services"][0]);
  CHECK(allowed["age"] >= 0);
  CHECK(allowed["urls"].size() == 1);
  CHECK_FALSE(trap.was_touched());
}

TEST_CASE("a rule by service type asks the node, and follows its services") {
  rr::RunningNode node([](rr::Node&) {});
  TestGateway gateway(0, allowing({{"", {}, "com.x.Arm"}}));
  gateway.announce(at(id_of(node), node.port(), "test.node", "empty"));
  wait_for_nodes(gateway, [](const json& all) { return all.size() == 1 && all[0]["services"].is_array(); });
  CHECK(wait_for_devices(gateway, [](const json&) { return true; }).empty());
  node.ask([](rr::Node& asked) {
    asked.add(make_thing());
    return 0;
  });
  gateway.announce(at(id_of(node), node.port(), "test.node", "with an arm"));
  wait_for_devices(gateway, [](const json& all) { return all.size() == 1 && all[0]["state"] == "online"; });
}

TEST_CASE("a rule by service type that a reload adds asks the nodes that are known") {
  rr::RunningNode node([](rr::Node& made) { made.add(make_thing()); });
  TestGateway gateway(0, allowing({}));
  gateway.announce(at(id_of(node), node.port(), "test.node"));
  wait_for_nodes(gateway, [](const json& all) { return all.size() == 1; });
  gateway.reconfigure(allowing({{"", {}, "com.x.Arm"}}));
  const auto devices =
      wait_for_devices(gateway, [](const json& all) { return all.size() == 1 && all[0]["state"] == "online"; });
  CHECK(devices[0]["name"] == "test.node");
}

TEST_CASE("a lost node takes its device along; one that comes back has its name again") {
  rr::RunningNode node([](rr::Node& made) { made.add(make_thing()); });
  TestGateway gateway(0, allowing({{"*", {}, ""}}));
  const auto news = at(id_of(node), node.port(), "test.node");
  for (int round = 0; round < 2; ++round) {
    gateway.announce(news);
    CHECK(wait_for_devices(gateway, [](const json& all) { return all.size() == 1; })[0]["name"] == "test.node");
    gateway.withdraw(news.node_id, news.url);
    wait_for_devices(gateway, [](const json& all) { return all.empty(); });
  }
}

TEST_CASE("a node at another port is reached there") {
  Trap dead;
  const auto port = dead.port();
  dead.acceptor.close();
  rr::RunningNode node([](rr::Node& made) { made.add(make_thing()); });
  auto id = id_of(node);
  TestGateway gateway(0, allowing({{"test.*", {}, ""}}));
  gateway.announce(at(id, port, "test.node"));
  wait_for_devices(gateway, [](const json& all) { return all.size() == 1 && all[0]["state"] == "offline"; });
  gateway.announce(at(id, node.port(), "test.node"));
  const auto devices = wait_for_devices(gateway, [](const json& all) { return all[0]["state"] == "online"; });
  CHECK(devices[0]["url"].get<std::string>().find(":" + std::to_string(node.port()) + "/") != std::string::npos);
}

TEST_CASE("a node that restarts with another id keeps the name of its device") {
  TestGateway gateway(0, [](Config& config) {
    allowing({{"test.*", {}, ""}})(config);
    config.retry.online = std::chrono::minutes(1);  // nobody looks before the other is announced
  });
  auto before = std::make_optional<rr::RunningNode>([](rr::Node&) {});
  const auto port = before->port();
  gateway.announce(at(id_of(*before), port, "test.node"));
  wait_for_devices(gateway, [](const json& all) { return all.size() == 1 && all[0]["state"] == "online"; });
  before.reset();
  rr::RunningNode after([&](rr::Node& made) { made.listen("rr+tcp://127.0.0.1:" + std::to_string(port)); });
  gateway.announce(at(id_of(after), port, "test.node"));
  const auto id = rr::format_node_id(id_of(after), rr::NodeIdFormat::dashes);
  wait_for_devices(gateway, [&](const json& all) {
    return all.size() == 1 && all[0]["name"] == "test.node" && all[0]["node_id"] == id && all[0]["state"] == "online";
  });
  CHECK(wait_for_nodes(gateway, [](const json& all) { return all.size() == 1; })[0]["node_id"] == id);
}

TEST_CASE("a device that answers stays when another node is announced at its place") {
  rr::RunningNode node([](rr::Node&) {});
  TestGateway gateway(0, allowing({{"test.*", {}, ""}}));
  gateway.announce(at(id_of(node), node.port(), "test.node"));
  wait_for_devices(gateway, [](const json& all) { return all.size() == 1 && all[0]["state"] == "online"; });
  gateway.announce(at(rr::NodeId{{0xab, 0xcd}}, node.port(), "test.node"));
  const auto devices = wait_for_devices(gateway, [](const json& all) { return all.size() == 2; });
  CHECK(devices[0]["name"] == "test.node");
  CHECK(devices[0]["state"] == "online");
  CHECK(devices[1]["name"] == "test.node-abcd0000");
}

TEST_CASE("a configured device is not found a second time, and names stay unique") {
  TestGateway gateway(1, allowing({{"*", {}, ""}}));
  gateway.wait_for_state("online");
  gateway.announce(at(gateway.device().node_id(), gateway.device().port(), "node.x"));
  gateway.announce(at(rr::NodeId{{0xab, 0xcd}}, 1, "x"));
  gateway.announce(at(rr::NodeId{{0x12}}, 2, ""));
  const auto devices = wait_for_devices(gateway, [](const json& all) { return all.size() >= 3; });
  CHECK(devices.size() == 3);
  CHECK(devices[1]["name"] == "x-abcd0000");
  CHECK(devices[2]["name"] == "node-12000000");
  const auto nodes = wait_for_nodes(gateway, [](const json& all) { return all.size() == 3; });
  for (const auto& node : nodes)
    if (node["node_name"] == "node.x") CHECK(node["device"] == "x");
}

TEST_CASE("a found device whose name a reload gives to a configured one has another name at once") {
  for (const auto mode : {DeviceMode::relay, DeviceMode::shared}) {
    rr::RunningNode node([](rr::Node& made) { made.add(make_thing()); });
    TestGateway gateway(1, [&](Config& config) {
      allowing({{"*", {}, ""}})(config);
      config.discover.mode = mode;
    });
    gateway.announce(at(id_of(node), node.port(), "test.node"));
    wait_for_devices(gateway, [](const json& all) { return all.size() == 2 && all[1]["state"] == "online"; });
    const auto url = "rr+tcp://127.0.0.1:" + std::to_string(gateway.port()) + "/?nodename=test.node&service=thing";
    auto thing = rr::connect(url);
    CHECK(thing.get("one").to<std::int32_t>().value() == 1);
    gateway.reconfigure([&](Config& config) {
      config.devices[0].name = "test.node";
      config.devices[0].mode = mode;
    });
    auto devices = wait_for_devices(gateway, [](const json&) { return true; });
    REQUIRE(devices.size() == 2);
    CHECK(devices[0]["name"] == "test.node");
    CHECK(devices[0]["found"] == false);
    CHECK(devices[1]["name"] == "test.node-" + rr::format_node_id(id_of(node), rr::NodeIdFormat::dashes).substr(0, 8));
    CHECK_THROWS(thing.get("one"));
    wait_for_devices(gateway, [](const json& all) { return all.size() == 2 && all[1]["state"] == "online"; });
  }
}

TEST_CASE("found devices are relayed or shared, as discovery is configured") {
  for (const auto mode : {DeviceMode::relay, DeviceMode::shared}) {
    rr::RunningNode node([](rr::Node& made) { made.add(make_thing()); });
    TestGateway gateway(0, [&](Config& config) {
      allowing({{"*", {}, ""}})(config);
      config.discover.mode = mode;
    });
    gateway.announce(at(id_of(node), node.port(), "test.node"));
    const auto found = wait_for_devices(gateway, [](const json& all) { return all.size() == 1; })[0];
    CHECK(found["mode"] == (mode == DeviceMode::shared ? "shared" : "relay"));
  }
}

TEST_CASE("found nodes with TLS are checked by the CA for found nodes") {
  rr::test::CertificateLab lab;
  rr::NodeOptions options;
  options.id = rr::test::service_node;
  options.tls = lab.context(lab.good(rr::test::service_node));
  options.require_tls = true;
  rr::RunningNode node([](rr::Node& made) { made.add(make_thing()); }, options);
  auto news = at(options.id, node.port(), "test.node");
  news.url.replace(0, 2, "rrs");
  const auto allow = allowing({{"", {}, "com.x.Arm"}});
  {
    TestGateway untrusting(0, allow);
    untrusting.announce(news);
    wait_for_nodes(untrusting, [](const json& all) { return all.size() == 1; });
    CHECK(wait_for_devices(untrusting, [](const json&) { return true; }).empty());
  }
  TestGateway gateway(0, [&](Config& config) {
    allow(config);
    config.discover.tls.ca = lab.trust().files;
  });
  gateway.announce(news);
  wait_for_devices(gateway, [](const json& all) { return all.size() == 1 && all[0]["state"] == "online"; });
}

TEST_CASE("a flood of nodes makes no more devices than may be") {
  TestGateway gateway(0, allowing({{"*", {}, ""}}, 3));
  for (std::uint8_t i = 1; i <= 50; ++i) gateway.announce(at(rr::NodeId{{i}}, i, "node" + std::to_string(i)));
  wait_for_nodes(gateway, [](const json& all) { return all.size() == 50; });
  CHECK(wait_for_devices(gateway, [](const json&) { return true; }).size() == 3);
}

TEST_CASE("a found device whose announcements end stays while it answers and has clients") {
  for (const auto mode : {DeviceMode::relay, DeviceMode::shared})
    for (const bool client_leaves : {true, false}) {
      TestGateway gateway(0, [&](Config& config) {
        allowing({{"*", {}, ""}})(config);
        config.discover.mode = mode;
      });
      auto node = std::make_optional<rr::RunningNode>([](rr::Node& made) { made.add(make_thing()); });
      const auto news = at(id_of(*node), node->port(), "test.node");
      gateway.announce(news);
      wait_for_devices(gateway, [](const json& all) { return all.size() == 1 && all[0]["state"] == "online"; });
      std::optional thing(
          rr::connect("rr+tcp://127.0.0.1:" + std::to_string(gateway.port()) + "/?nodename=test.node&service=thing"));
      gateway.withdraw(news.node_id, news.url);
      wait_for_nodes(gateway, [](const json& all) { return all.empty(); });
      CHECK(wait_for_devices(gateway, [](const json&) { return true; }).size() == 1);
      CHECK(thing->get("one").to<std::int32_t>().value() == 1);
      if (client_leaves)
        thing.reset();
      else
        node.reset();
      wait_for_devices(gateway, [](const json& all) { return all.empty(); });
    }
}

TEST_CASE("a reload of where nodes are found keeps the found devices that clients use") {
  rr::RunningNode used([](rr::Node& made) { made.add(make_thing()); });
  TestGateway gateway(0, [&](Config& config) {
    allowing({{"", id_of(used), ""}, {"", rr::NodeId{{7}}, ""}})(config);
    config.discover.mode = DeviceMode::shared;
  });
  gateway.announce(at(id_of(used), used.port(), "test.node"));
  gateway.announce(at(rr::NodeId{{7}}, 1, "other.node"));
  wait_for_devices(gateway, [](const json& all) { return all.size() == 2; });
  auto thing =
      rr::connect("rr+tcp://127.0.0.1:" + std::to_string(gateway.port()) + "/?nodename=test.node&service=thing");
  gateway.reconfigure([](Config& config) { config.discover.scopes = {"node_local"}; });
  const auto devices = wait_for_devices(gateway, [](const json&) { return true; });
  REQUIRE(devices.size() == 1);
  CHECK(devices[0]["name"] == "test.node");
  CHECK(thing.get("one").to<std::int32_t>().value() == 1);
  gateway.reconfigure([](Config& config) { config.discover.allow.clear(); });
  CHECK(wait_for_devices(gateway, [](const json&) { return true; }).empty());
  CHECK_THROWS(thing.get("one"));
}
