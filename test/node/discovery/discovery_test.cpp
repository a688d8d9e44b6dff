// Discovery without packets: announcements are handed in, nodes are real ones on the loopback.
#include "node/discovery/discovery.hpp"

#include <boost/asio/bind_cancellation_slot.hpp>
#include <boost/asio/cancellation_signal.hpp>
#include <boost/asio/co_spawn.hpp>
#include <boost/asio/detached.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <catch2/catch.hpp>

#include "node/discovery/ip_discovery.hpp"
#include "test/node/discovery/things.hpp"
#include "test/node/node/node_fixture.hpp"
#include "test/node/transport/certificate_lab.hpp"

using namespace rr;
using rr::test::make_thing;
using std::chrono::milliseconds;

namespace {

/// A Discovery that hears only what the test says.
struct Listener {
  Listener()
      : discovery(io, DiscoveryOptions{.ip = std::nullopt, .intra = false, .local = false, .hardware = std::nullopt}) {}

  void hear(const NodeId& id, std::uint16_t port, const std::string& name = "test.node") {
    discovery.handle_announcement({id, name,
                                   "rr+tcp://127.0.0.1:" + std::to_string(port) + "/?nodeid=" +
                                       format_node_id(id, NodeIdFormat::dashes) + "&service=RobotRaconteurServiceIndex",
                                   "nonce"});
  }
  /// Runs the coroutine to its end.
  template <class T>
  T get(awaitable<T> work) {
    std::optional<T> result;
    boost::asio::co_spawn(io, std::move(work), [&](std::exception_ptr failure, T value) {
      if (failure) std::rethrow_exception(failure);
      result = std::move(value);
    });
    while (!result) {
      io.restart();
      io.run_one_for(milliseconds(50));
    }
    return std::move(*result);
  }

  boost::asio::io_context io{1};
  Discovery discovery;
};

NodeId id_of(RunningNode& node) {
  return node.ask([](Node& asked) { return asked.identity().id; });
}

}  // namespace

TEST_CASE("services are found by the type of their root object and by its base") {
  RunningNode node([](Node& made) {
    made.add(make_thing("thing", "4"));
    made.add(make_thing("other_thing"));
  });
  Listener listener;
  listener.hear(id_of(node), node.port());
  for (const auto* type : {"experimental.found.Thing", "experimental.found.Base"}) {
    auto found = listener.get(listener.discovery.find_service_by_type(type, {"rr+tcp"}, milliseconds(4000)));
    REQUIRE(found.size() == 2);
    if (found[0].name != "thing") std::swap(found[0], found[1]);
    CHECK(found[0].node.id == id_of(node));
    CHECK(found[0].node.name == "test.node");
    CHECK(found[0].root_object_type == "experimental.found.Thing");
    REQUIRE(found[0].attributes.items.size() == 1);
    CHECK(found[0].attributes.items[0].first == "room");
    CHECK(connect(found[0].connection_url).get("one").to<std::int32_t>().value() == 1);
  }
  CHECK(listener.get(listener.discovery.find_service_by_type("experimental.found.Nothing", {}, milliseconds(400)))
            .empty());
  CHECK(listener.get(listener.discovery.find_service_by_type("experimental.found.Base", {"rrs+tcp"}, milliseconds(400)))
            .empty());
}

TEST_CASE("who answers must be the node that was announced") {
  RunningNode node([](Node& made) { made.add(make_thing("thing")); });
  Listener wrong_id;
  wrong_id.hear(NodeId{{1, 2, 3}}, node.port());
  CHECK(
      wrong_id.get(wrong_id.discovery.find_service_by_type("experimental.found.Base", {}, milliseconds(400))).empty());
  Listener wrong_name;
  wrong_name.hear(id_of(node), node.port(), "somebody.else");
  CHECK(wrong_name.get(wrong_name.discovery.find_service_by_type("experimental.found.Base", {}, milliseconds(400)))
            .empty());
}

TEST_CASE("an answer that is too long does not count") {
  RunningNode node([](Node& made) { made.add(make_thing("thing", std::string(64 * 1024, 'x'))); });
  Listener listener;
  listener.hear(id_of(node), node.port());
  CHECK(
      listener.get(listener.discovery.find_service_by_type("experimental.found.Base", {}, milliseconds(800))).empty());
}

TEST_CASE("a node that does not answer holds nobody up beyond the timeout") {
  RunningNode node([](Node& made) { made.add(make_thing("thing")); });
  Listener listener;
  boost::asio::ip::tcp::acceptor silent(listener.io, {boost::asio::ip::address_v4::loopback(), 0});
  listener.hear(NodeId{{1, 2, 3}}, silent.local_endpoint().port(), "silent");
  listener.hear(id_of(node), node.port());
  const auto begin = std::chrono::steady_clock::now();
  CHECK(
      listener.get(listener.discovery.find_service_by_type("experimental.found.Base", {}, milliseconds(2000))).size() ==
      1);
  CHECK(std::chrono::steady_clock::now() - begin < milliseconds(4000));
}

TEST_CASE("of several URLs the one that answers is taken") {
  RunningNode node([](Node& made) { made.add(make_thing("thing")); });
  Listener listener;
  boost::asio::ip::tcp::acceptor silent(listener.io, {boost::asio::ip::address_v4::loopback(), 0});
  listener.hear(id_of(node), node.port());
  listener.hear(id_of(node), silent.local_endpoint().port());
  const auto found =
      listener.get(listener.discovery.find_service_by_type("experimental.found.Base", {}, milliseconds(3000)));
  REQUIRE(found.size() == 1);
  CHECK_THAT(found[0].connection_url, Catch::Contains(std::to_string(node.port())));
}

TEST_CASE("nodes are found by id and by name, also those that come while one waits") {
  Listener listener;
  listener.hear(NodeId{{1}}, 1, "arm");
  auto& discovery = listener.discovery;
  CHECK(listener.get(discovery.find_node_by_id(NodeId{{1}})).size() == 1);
  CHECK(listener.get(discovery.find_node_by_id(NodeId{{1}}, {"rr+local"}, milliseconds(50))).empty());
  CHECK(listener.get(discovery.find_node_by_name("hand", {}, milliseconds(50))).empty());
  boost::asio::steady_timer later(listener.io, milliseconds(100));
  later.async_wait([&](const boost::system::error_code&) {
    listener.hear(NodeId{{2}}, 1, "other");
    listener.hear(NodeId{{3}}, 1, "hand");
  });
  const auto found = listener.get(discovery.find_node_by_name("hand"));
  REQUIRE(found.size() == 1);
  CHECK(found[0].node_id == NodeId{{3}});
}

TEST_CASE("watchers hear of nodes that are there, that come and that go") {
  Listener listener;
  auto& discovery = listener.discovery;
  listener.hear(NodeId{{1}}, 1);
  std::string heard;
  const auto watch = discovery.watch([&](const NodeEvent& event) {
    heard += "fcl"[static_cast<int>(event.kind)] + std::to_string(event.node.node_id.bytes[0]) + " ";
  });
  listener.hear(NodeId{{2}}, 1);
  listener.hear(NodeId{{2}}, 2);
  discovery.handle_withdrawn(NodeId{{1}}, discovery.detected_nodes()[0].urls[0].url);
  CHECK(heard == "f1 f2 c2 l1 ");
  discovery.unwatch(watch);
  listener.hear(NodeId{{3}}, 1);
  CHECK(heard == "f1 f2 c2 l1 ");
}

TEST_CASE("a node expires by itself") {
  constexpr milliseconds expiry{50};
  boost::asio::io_context io;
  Discovery discovery(
      io,
      DiscoveryOptions{
          .ip = std::nullopt, .intra = false, .local = false, .hardware = std::nullopt, .cache = {.expiry = expiry}});
  const auto begin = std::chrono::steady_clock::now();
  discovery.handle_announcement({NodeId{{1}}, "n", "rr+tcp://127.0.0.1:1/?service=x", ""});
  CHECK(discovery.detected_nodes().size() == 1);
  bool is_lost = false;
  discovery.watch([&](const NodeEvent& event) { is_lost = event.kind == NodeEvent::Kind::lost; });
  while (!is_lost && std::chrono::steady_clock::now() < begin + std::chrono::seconds(10)) io.run_one_for(expiry);
  CHECK(is_lost);
  CHECK(std::chrono::steady_clock::now() - begin >= expiry);
  CHECK(discovery.detected_nodes().empty());
}

TEST_CASE("a search that outlives its Discovery finds nothing") {
  boost::asio::io_context io;
  auto discovery = std::make_unique<Discovery>(
      io, DiscoveryOptions{.ip = std::nullopt, .intra = false, .local = false, .hardware = std::nullopt});
  int ended = 0;
  const auto count = [&](std::exception_ptr, auto found) { ended += found.empty() ? 1 : 100; };
  boost::asio::co_spawn(io, discovery->find_service_by_type("a"), count);
  boost::asio::co_spawn(io, discovery->find_node_by_name("a"), count);
  io.run_for(milliseconds(20));
  CHECK(ended == 0);
  discovery.reset();
  io.restart();
  io.run_for(milliseconds(500));
  CHECK(ended == 2);
}

TEST_CASE("a node says where it listens, and when it has another service") {
  Node node("test.node");
  CHECK(node.listen_urls().empty());
  int changes = 0;
  node.on_services_changed([&] { ++changes; });
  node.add(make_thing("thing"));
  const auto port = node.listen("rr+tcp://127.0.0.1:0");
  CHECK(changes == 2);
  REQUIRE(node.listen_urls().size() == 1);
  CHECK(node.listen_urls()[0] == "rr+tcp://127.0.0.1:" + std::to_string(port) +
                                     "?nodeid=" + format_node_id(node.identity().id, NodeIdFormat::dashes));
  node.stop();
  CHECK(node.listen_urls().empty());
}

TEST_CASE("found nodes are asked by TLS where their CA is trusted") {
  rr::test::CertificateLab lab;
  NodeOptions options;
  options.id = rr::test::service_node;
  options.tls = lab.context(lab.good(rr::test::service_node));
  options.require_tls = true;
  RunningNode node([](Node& made) { made.add(make_thing("thing")); }, options);
  for (const bool is_trusted : {false, true}) {
    boost::asio::io_context io(1);
    DiscoveryOptions how{.ip = std::nullopt, .intra = false, .local = false, .hardware = std::nullopt};
    if (is_trusted) how.dial.tls = lab.anonymous();
    Discovery discovery(io, how);
    discovery.handle_announcement({options.id, "test.node",
                                   "rrs+tcp://127.0.0.1:" + std::to_string(node.port()) +
                                       "/?nodeid=" + format_node_id(options.id, NodeIdFormat::dashes) +
                                       "&service=RobotRaconteurServiceIndex",
                                   "nonce"});
    std::optional<std::vector<ServiceInfo>> found;
    boost::asio::co_spawn(io, discovery.find_service_by_type("experimental.found.Thing", {}, milliseconds(4000)),
                          [&](std::exception_ptr, auto services) { found = std::move(services); });
    while (!found) io.run_one_for(milliseconds(50));
    CHECK(found->size() == (is_trusted ? 1 : 0));
  }
}

TEST_CASE("discovery that ends leaves no socket that waits for packets") {
  boost::asio::io_context io(1);
  IpDiscoveryScopes scopes;
  scopes.link_local = scopes.site_local = scopes.ipv4_broadcast = false;
  scopes.node_local = true;
  {
    const IpDiscovery ended(io.get_executor(), scopes, true, {[](auto&&...) {}, [] {}, [](auto&&...) {}});
  }
  io.run_for(std::chrono::seconds(10));
  CHECK(io.stopped());
}

TEST_CASE("a search that is cancelled is not told of nodes any more") {
  Listener listener;
  boost::asio::cancellation_signal cancelled;
  bool is_over = false;
  boost::asio::co_spawn(listener.io, listener.discovery.find_node_by_name("nobody", {}, std::chrono::seconds(60)),
                        boost::asio::bind_cancellation_slot(cancelled.slot(), [&](auto&&...) { is_over = true; }));
  listener.io.poll();
  cancelled.emit(boost::asio::cancellation_type::terminal);
  listener.io.restart();
  listener.io.poll();
  REQUIRE(is_over);
  listener.hear(random_node_id(), 1);
  CHECK(listener.discovery.detected_nodes().size() == 1);
}
