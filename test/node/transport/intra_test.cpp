// Client and service in one process.
#include "node/transport/intra.hpp"

#include <boost/asio/co_spawn.hpp>
#include <catch2/catch.hpp>

#include "core/support/random.hpp"
#include "node/discovery/discovery.hpp"
#include "test/node/node/node_fixture.hpp"

using namespace rr;
using Catch::Matchers::Contains;
using std::chrono::milliseconds;

namespace {

std::shared_ptr<Service> make_sum() {
  auto service = Service::from_text({"service test.sum\nobject Sum\nfunction double add(double a, double b)\nend\n"},
                                    "Sum", "Sum");
  service->function("add", [](double a, double b) { return a + b; });
  return service;
}

void offer_sum(Node& node) {
  node.add(make_sum());
  node.listen("rr+intra:///");
}

double add_at(const std::string& url) {
  return connect(url).call("add", 1.5, 2.25).to<double>().value();
}

NodeId id_of(RunningNode& node) {
  return node.ask([](Node& asked) { return asked.identity().id; });
}

}  // namespace

TEST_CASE("nodes of one process are reached by name and by ID, each on its thread") {
  RunningNode one(offer_sum, {}, "one.node");
  RunningNode two(offer_sum, {}, "two.node");
  const auto by_id = "rr+intra:///?nodeid=" + format_node_id(id_of(two)) + "&service=Sum";
  CHECK(add_at("rr+intra:///?nodename=one.node&service=Sum") == 3.75);
  CHECK(add_at(by_id) == 3.75);
  CHECK(add_at(by_id + "&nodename=two.node") == 3.75);
  CHECK(error_of([&] { connect(by_id + "&nodename=one.node"); }).code == ErrorCode::node_not_found);
  const auto nobody = error_of([] { connect("rr+intra:///?nodename=no.node&service=Sum"); });
  CHECK(nobody.code == ErrorCode::node_not_found);
  CHECK_THAT(nobody.message, Contains("no such node of this process"));

  auto client = connect(by_id);
  two.stop();
  two.join();
  CHECK(error_of([&] { client.call("add", 1.0, 2.0); }).code != ErrorCode::none);
  CHECK(error_of([&] { connect(by_id); }).code == ErrorCode::node_not_found);
}

TEST_CASE("one ID is one node's") {
  NodeOptions options;
  options.id = random_node_id();
  Node first("first", options);
  first.listen("rr+intra:///");
  Node second("second", options);
  CHECK_THROWS_WITH(second.listen("rr+intra:///"), Contains("another node of this process has the ID"));
  CHECK_THROWS_WITH(first.listen("rr+intra:///"), Contains("does so already"));
}

TEST_CASE("client and service may share a thread, and find one another") {
  boost::asio::io_context io(1);
  Discovery discovery(io, DiscoveryOptions{.ip = std::nullopt, .local = false, .hardware = std::nullopt});
  std::vector<NodeEvent::Kind> seen;
  auto node = std::make_unique<Node>(io, "sim.node");
  const auto id = node->identity().id;
  discovery.watch([&](const NodeEvent& event) {
    if (event.node.node_id == id) seen.push_back(event.kind);
  });
  offer_sum(*node);
  std::optional<std::vector<ServiceInfo>> found;
  boost::asio::co_spawn(io, discovery.find_service_by_type("test.sum.Sum", {"rr+intra"}, milliseconds(1000)),
                        [&](std::exception_ptr, auto services) { found = std::move(services); });
  for (int i = 0; i < 100 && !found; ++i) {
    io.restart();
    io.run_for(milliseconds(50));
  }
  REQUIRE(found);
  REQUIRE(found->size() == 1);
  CHECK(found->front().node.name == "sim.node");
  CHECK_THAT(found->front().connection_url, Contains("rr+intra:///?nodeid="));

  node->add(Service::from_text({"service test.more\nobject More\nend\n"}, "More", "More"));
  io.restart();
  io.run_for(milliseconds(100));
  node.reset();
  io.restart();
  io.run_for(milliseconds(100));
  CHECK(seen == std::vector<NodeEvent::Kind>{NodeEvent::Kind::found, NodeEvent::Kind::changed, NodeEvent::Kind::lost});
}
