// Subscriptions by type: announcements are handed in, nodes are real ones on the loopback. And their filters.
#include "node/subscribe/subscribe_service_by_type.hpp"

#include <boost/asio/ip/tcp.hpp>
#include <catch2/catch.hpp>

#include "core/support/random.hpp"
#include "test/node/discovery/things.hpp"
#include "test/node/node/node_fixture.hpp"

using namespace rr;
using rr::test::make_thing;
using namespace std::chrono_literals;

namespace {

std::shared_ptr<Service> make_other(const std::string& name) {
  auto service = Service::from_text({rr::test::things_definition}, name, "Other");
  service->property("two").get([] { return 2; }).set([](std::int32_t) {});
  return service;
}

NodeId id_of(RunningNode& node) {
  return node.ask([](Node& asked) { return asked.identity().id; });
}

/// A Discovery that hears only what the test says, and what became of a subscription.
struct Listener {
  Listener() : discovery(io, DiscoveryOptions{.ip = std::nullopt, .local = false, .hardware = std::nullopt}) {
    options.first_retry = 50ms;
  }

  void hear(const NodeId& id, std::uint16_t port, const std::string& nonce = "nonce",
            const std::string& name = "test.node") {
    discovery.handle_announcement({id, name, url_of(id, port), nonce});
  }
  static std::string url_of(const NodeId& id, std::uint16_t port) {
    return "rr+tcp://127.0.0.1:" + std::to_string(port) + "/?nodeid=" + format_node_id(id, NodeIdFormat::dashes) +
           "&service=RobotRaconteurServiceIndex";
  }
  ServiceSubscription subscribe(std::vector<std::string> types, ServiceSubscriptionFilter filter = {}) {
    auto things = subscribe_service_by_type(discovery, std::move(types), std::move(filter), options);
    things.on_connected([this](const AsyncObject& client) {
      ++connected[client.path()];
      urls.push_back(client.connection()->session().connection().peer().name);
    });
    things.on_lost([this](const AsyncObject& client, const Error&) { ++lost[client.path()]; });
    things.on_failed([this](const Error&, const std::string&) { ++failures; });
    return things;
  }
  bool run_until(const std::function<bool()>& is_done, std::chrono::milliseconds timeout = 5s) {
    const auto limit = std::chrono::steady_clock::now() + timeout;
    while (!is_done() && std::chrono::steady_clock::now() < limit) {
      io.restart();
      io.run_one_for(20ms);
    }
    return is_done();
  }
  void run_for(std::chrono::milliseconds duration) {
    io.restart();
    io.run_for(duration);
  }

  boost::asio::io_context io{1};
  Discovery discovery;
  SubscriptionOptions options;
  std::map<std::string, int> connected;
  std::map<std::string, int> lost;
  std::vector<std::string> urls;
  int failures = 0;
};

ServiceInfo info_with(const std::string& attribute, Value value) {
  ServiceInfo service;
  service.node = {NodeId{{1}}, "lab.arm"};
  service.name = "arm";
  service.attributes.items.emplace_back(attribute, std::move(value));
  return service;
}

}  // namespace

TEST_CASE("a subscription by type connects every service of the type, or of its base") {
  RunningNode first([](Node& made) {
    made.add(make_thing("a"));
    made.add(make_thing("b"));
    made.add(make_other("c"));
  });
  RunningNode second([](Node& made) { made.add(make_thing("d")); });
  Listener listener;
  listener.hear(id_of(first), first.port());
  const auto type = GENERATE("experimental.found.Thing", "experimental.found.Base");
  auto things = listener.subscribe({type});
  REQUIRE(listener.run_until([&] { return listener.connected.size() == 2; }));
  listener.hear(id_of(second), second.port());  // comes later
  REQUIRE(listener.run_until([&] { return listener.connected.size() == 3; }));
  CHECK(listener.connected == std::map<std::string, int>{{"a", 1}, {"b", 1}, {"d", 1}});
  const auto clients = things.clients();
  CHECK(clients.size() == 3);
  CHECK(clients.contains(ServiceSubscriptionClientId{id_of(second), "d"}));
  CHECK(things.default_client()->path() != "d");
}

TEST_CASE("an announced service that comes later is connected, one that goes only with its connection") {
  auto node = std::make_unique<RunningNode>([](Node& made) { made.add(make_thing("a")); });
  const auto id = id_of(*node);
  Listener listener;
  listener.hear(id, node->port(), "1");
  auto things = listener.subscribe({"experimental.found.Base"});
  REQUIRE(listener.run_until([&] { return listener.connected["a"] == 1; }));
  node->ask([](Node& made) { return made.add(make_thing("b")), true; });
  listener.hear(id, node->port(), "2");
  REQUIRE(listener.run_until([&] { return listener.connected["b"] == 1; }));
  listener.discovery.handle_withdrawn(id, Listener::url_of(id, node->port()));
  listener.run_for(100ms);
  CHECK(things.clients().size() == 2);
  node.reset();
  REQUIRE(listener.run_until([&] { return listener.lost.size() == 2; }));
  listener.run_for(200ms);
  CHECK(listener.failures == 0);  // nobody says that it is there: not tried again
}

TEST_CASE("a node that restarts on another port is connected again") {
  NodeOptions options;
  options.id = random_node_id();
  const auto prepare = [](Node& made) { made.add(make_thing("a")); };
  auto node = std::make_unique<RunningNode>(prepare, options);
  Listener listener;
  listener.options.first_retry = 10min;
  listener.hear(options.id, node->port(), "1");
  auto things = listener.subscribe({"experimental.found.Base"});
  REQUIRE(listener.run_until([&] { return listener.connected["a"] == 1; }));
  node.reset();
  REQUIRE(listener.run_until([&] { return listener.lost["a"] == 1; }));
  node = std::make_unique<RunningNode>(prepare, options);
  listener.hear(options.id, node->port(), "2");
  CHECK(listener.run_until([&] { return listener.connected["a"] == 2; }));
}

TEST_CASE("no more services than the limit, others when there is room again") {
  auto first = std::make_unique<RunningNode>([](Node& made) { made.add(make_thing("a")); });
  RunningNode second([](Node& made) { made.add(make_thing("b")); });
  const auto first_id = id_of(*first);
  Listener listener;
  listener.options.max_clients = 1;
  listener.hear(first_id, first->port());
  auto things = listener.subscribe({"experimental.found.Base"});
  REQUIRE(listener.run_until([&] { return listener.connected.size() == 1; }));
  listener.hear(id_of(second), second.port());
  listener.run_for(800ms);  // it would be asked within 0.6 s
  CHECK(things.clients().size() == 1);
  listener.discovery.handle_withdrawn(first_id, Listener::url_of(first_id, first->port()));
  first.reset();
  CHECK(listener.run_until([&] { return listener.connected["b"] == 1; }));
}

TEST_CASE("filters: nodes, services, attributes, schemes and a predicate") {
  RunningNode node([](Node& made) {
    made.add(make_thing("a", "attic,cellar"));
    made.add(make_thing("b", "kitchen"));
  });
  Listener listener;
  listener.hear(id_of(node), node.port());
  ServiceSubscriptionFilter filter;
  std::string expected = "a";
  SECTION("service name") {
    filter.service_names.push_back("a");
  }
  SECTION("attribute") {
    filter.attributes["room"].attributes.emplace_back("cellar");
  }
  SECTION("attribute, not of") {
    auto& room = filter.attributes["room"];
    room.operation = ServiceSubscriptionFilterOperation::nor_of;
    room.attributes.emplace_back("kitchen");
  }
  SECTION("predicate") {
    filter.predicate = [](const ServiceInfo& service) { return service.name == "a"; };
  }
  SECTION("node by name and id") {
    ServiceSubscriptionFilterNode wanted;
    wanted.node_name = "test.*";
    wanted.node_id = id_of(node);
    filter.nodes.push_back(wanted);
    filter.service_names.push_back("a");
  }
  SECTION("another node") {
    ServiceSubscriptionFilterNode wanted;
    wanted.node_name = "lab.*";
    filter.nodes.push_back(wanted);
    expected.clear();
  }
  SECTION("another scheme") {
    filter.transport_schemes.push_back("rrs+tcp");
    expected.clear();
  }
  auto things = listener.subscribe({"experimental.found.Base"}, filter);
  if (!expected.empty()) REQUIRE(listener.run_until([&] { return listener.connected.contains(expected); }));
  listener.run_for(expected.empty() ? 800ms : 100ms);
  CHECK(listener.connected.size() == (expected.empty() ? 0 : 1));
}

TEST_CASE("closing a subscription by type leaves nothing behind, whatever nodes do") {
  RunningNode node([](Node& made) { made.add(make_thing("a")); });
  Listener listener;
  boost::asio::ip::tcp::acceptor silent(listener.io, {boost::asio::ip::address_v4::loopback(), 0});
  listener.hear(NodeId{{1, 2, 3}}, silent.local_endpoint().port(), "1", "silent");
  listener.hear(NodeId{{3, 2, 1}}, 1, "1", "gone");
  listener.hear(id_of(node), node.port());
  {
    auto things = listener.subscribe({"experimental.found.Base"});
    REQUIRE(listener.run_until([&] { return listener.connected.size() == 1; }));
    listener.run_for(700ms);  // all are being asked by now
  }
  // The Discovery itself waits for what expires, so that the io_context has work all the same: it must not call us.
  const auto open = [&] { return node.ask([](Node& asked) { return asked.client_count(); }); };
  CHECK(listener.run_until([&] { return open() == 0; }, 1s));
  boost::asio::ip::tcp::socket accepted(listener.io);
  silent.accept(accepted);  // the question that nobody answered: its socket is closed
  accepted.non_blocking(true);
  char byte[4096];
  boost::system::error_code end;
  CHECK(listener.run_until(
      [&] {
        end = {};
        while (!end) accepted.read_some(boost::asio::buffer(byte), end);
        return end == boost::asio::error::eof || end == boost::asio::error::connection_reset;
      },
      1s));
}

TEST_CASE("attribute groups combine texts, lists and maps") {
  using Operation = ServiceSubscriptionFilterOperation;
  ServiceSubscriptionFilter filter;
  auto& group = filter.attributes["kind"];
  const auto takes = [&](Value value) { return filter.takes(info_with("kind", std::move(value))); };
  CHECK(takes("anything"));  // no condition
  group.attributes.emplace_back("arm");
  CHECK(takes("arm"));
  CHECK(takes("leg,arm"));
  CHECK_FALSE(takes("armful"));
  CHECK_FALSE(filter.takes(info_with("other", "arm")));
  group.attributes.emplace_back(std::regex("[0-9]+ axes"));
  CHECK(takes("6 axes"));
  CHECK_FALSE(takes("6 axes and a half"));
  CHECK_FALSE(takes(std::string(100'000, '6')));  // too long for a regular expression, and no crash
  group.operation = Operation::and_of;
  CHECK(takes("arm,6 axes"));
  CHECK_FALSE(takes("arm"));
  group.operation = Operation::nand_of;
  CHECK(takes("arm"));
  CHECK_FALSE(takes("arm,6 axes"));
  group.operation = Operation::or_of;
  group.attributes.clear();
  group.attributes.emplace_back("arm").name = "type";
  MapString map;
  map.items.emplace_back("type", Value("arm"));
  map.items.emplace_back("maker", Value("leg"));
  CHECK(takes(map));
  group.attributes.front().name = "maker";
  CHECK_FALSE(takes(map));
  List list;
  list.items.emplace_back("leg");
  group.attributes.clear();
  ServiceSubscriptionFilterAttributeGroup inner;
  inner.attributes.emplace_back("leg");
  group.groups.push_back(inner);
  CHECK(takes(list));
  CHECK_FALSE(takes("arm"));
}

TEST_CASE("a text is split, those of lists and maps are not") {
  ServiceSubscriptionFilter filter;
  auto& group = filter.attributes["kind"];
  const auto takes = [&](Value value) { return filter.takes(info_with("kind", std::move(value))); };
  List list;
  list.items.emplace_back("leg,arm");
  MapString map;
  map.items.emplace_back("type", Value("leg,arm"));
  group.attributes.emplace_back("arm");
  CHECK(takes("leg,arm"));
  CHECK_FALSE(takes(list));
  CHECK_FALSE(takes(map));
  group.attributes.front() = "leg,arm";
  CHECK_FALSE(takes("leg,arm"));
  CHECK(takes(list));
  CHECK(takes(map));
}

TEST_CASE("of no conditions, any and all hold, and their opposites do not") {
  using Operation = ServiceSubscriptionFilterOperation;
  const auto [operation, is_taken] = GENERATE(table<Operation, bool>(
      {{Operation::or_of, true}, {Operation::and_of, true}, {Operation::nor_of, false}, {Operation::nand_of, false}}));
  ServiceSubscriptionFilter filter;
  filter.attributes_operation = operation;
  CHECK(filter.takes(info_with("kind", "arm")));  // no attribute is asked about
  filter.attributes_operation = Operation::and_of;
  filter.attributes["kind"].operation = operation;
  CHECK(filter.takes(info_with("kind", "arm")) == is_taken);
}
