// Pipes of services and clients over real sockets: handlers, refusals, broadcasts to clients that lag behind.
#include <catch2/catch.hpp>

#include "test/node/node/node_fixture.hpp"
#include "test/support/print.hpp"

using namespace rr;
using namespace std::chrono_literals;
using Catch::Matchers::Contains;
using Catch::Matchers::Equals;

namespace {

constexpr const char* definition = R"(service test.belt
stdver 0.10

object Belt
    pipe int16 parts
    pipe double[] scans [readonly]
    pipe string orders [writeonly]
    function void settle()
end
)";

struct Belt {
  std::shared_ptr<Service> service = Service::from_text({definition}, "belt", "Belt");
  std::vector<std::string> problems;
  std::vector<std::string> log;
  RunningNode node{[this](Node& made) {
                     service->function("settle", [] {});
                     service->pipe("parts")
                         .on_connect([this](const PipeEndpoint& endpoint) {
                           log.push_back("connect " + std::to_string(endpoint.index()));
                           if (endpoint.index() == 13) throw ServiceException("not that one");
                         })
                         .on_packet([this](const PipeEndpoint& endpoint, std::int16_t part) {
                           log.push_back("part " + std::to_string(part));
                           if (part == 0) throw std::runtime_error("empty");
                           if (part < 0) return endpoint.close();
                           endpoint.send(Value(part + 1)).value();
                         })
                         .on_close([this](const PipeEndpoint& endpoint) {
                           log.push_back((endpoint.is_open() ? "open " : "close ") + std::to_string(endpoint.index()));
                         });
                     made.add(service);
                   },
                   {.report = [this](const std::string& problem) { problems.push_back(problem); }}};

  RemoteObject connect() const { return rr::connect(node.url("belt")); }
  std::vector<std::string> log_now() {
    return node.ask([this](Node&) { return log; });
  }
};

using Log = std::vector<std::string>;

}  // namespace

TEST_CASE("a client's packets reach the handler with their endpoint, and are answered there") {
  Belt belt;
  const auto client = belt.connect();
  std::vector<Value> received;
  const auto endpoint = client.connect_pipe("parts", [&](Value packet) { received.push_back(std::move(packet)); });
  CHECK(endpoint.index() == 1);
  endpoint.send(Value(5));
  endpoint.send(Value(7));
  REQUIRE(client.connection().run_until([&] { return received.size() == 2; }, 5s));
  CHECK(received == std::vector<Value>{Value(std::int16_t{6}), Value(std::int16_t{8})});
  endpoint.close();
  CHECK_FALSE(endpoint.is_open());
  CHECK(error_of([&] { endpoint.send(Value(9)); }).code == ErrorCode::invalid_operation);
  endpoint.close();
  CHECK(belt.log_now() == Log{"connect 1", "part 5", "part 7", "close 1"});
}

TEST_CASE("a service refuses an endpoint, closes one, and survives a handler that fails") {
  Belt belt;
  const auto client = belt.connect();
  CHECK(error_of([&] {
          client.connect_pipe(
              "parts", [](const Value&) {}, 13);
        }).message == "not that one");
  const auto endpoint = client.connect_pipe("parts", [](const Value&) {});
  endpoint.send(Value(0));
  endpoint.send(Value(-1));
  REQUIRE(client.connection().run_until([&] { return !endpoint.is_open(); }, 5s));
  CHECK(belt.log_now() == Log{"connect 13", "connect 1", "part 0", "part -1"});
  CHECK(belt.node.ask([&](Node&) { return belt.problems; }) == Log{"pipe 'parts': its handler failed: empty"});
  CHECK(belt.node.ask([&](Node&) { return belt.service->pipe("parts").endpoints().size(); }) == 0);
}

TEST_CASE("endpoints of a client that is gone are closed, and say so to who kept them") {
  Belt belt;
  std::optional<PipeEndpoint> kept;
  {
    const auto client = belt.connect();
    client.connect_pipe("parts", [](const Value&) {});
    client.connect_pipe("scans", [](const Value&) {});
    belt.node.ask([&](Node&) { return kept.emplace(belt.service->pipe("scans").endpoints().front()), 0; });
  }
  CHECK_FALSE(belt.node.ask([&](Node&) { return kept->is_open(); }));
  CHECK(belt.log_now() == Log{"connect 1", "close 1"});
  CHECK(belt.node.ask([&](Node&) { return kept->send(Array::take(std::vector<double>{})).error().message; }) ==
        "pipe 'scans': the endpoint is closed");
  belt.node.ask([&](Node&) { return kept.reset(), 0; });
}

TEST_CASE("a broadcast leaves out endpoints that lag behind, counts it, and goes on when they have caught up") {
  Belt belt;
  const auto slow = belt.connect();
  int packets = 0;
  const auto endpoint = slow.connect_pipe("scans", [&](const Value&) { ++packets; });
  // The client does not run: it acknowledges nothing.
  const auto broadcast = [&](std::int32_t max_backlog) {
    return belt.node.ask([&, max_backlog](Node&) {
      return belt.service->pipe("scans").broadcast(Array::take(std::vector<double>{1, 2}), max_backlog);
    });
  };
  const auto state = [&] {
    return belt.node.ask([&](Node&) {
      const auto one = belt.service->pipe("scans").endpoints().front();
      return std::pair(one.backlog(), one.missed());
    });
  };
  CHECK(broadcast(1) == 1);
  CHECK(broadcast(1) == 1);
  CHECK(broadcast(1) == 0);
  CHECK(broadcast(1) == 0);
  CHECK(state() == std::pair<std::size_t, std::uint64_t>(2, 2));
  CHECK(broadcast(no_backlog_limit) == 1);
  CHECK(state() == std::pair<std::size_t, std::uint64_t>(2, 2));
  REQUIRE(slow.connection().run_until([&] { return packets == 3; }, 5s));
  slow.call("settle");  // behind the acknowledgements
  CHECK(state() == std::pair<std::size_t, std::uint64_t>(0, 2));
  CHECK(broadcast(0) == 1);
  CHECK(broadcast(0) == 0);
  CHECK(endpoint.is_open());
}

TEST_CASE("a sender that meets a full stream waits for room, and every packet arrives") {
  Belt belt;
  std::size_t items = 0;
  std::size_t packets = 0;
  belt.node.ask([&](Node&) {
    belt.service->pipe("orders").on_packet([&](const PipeEndpoint&, const std::string& order) {
      ++packets;
      items += order.size();
    });
    return 0;
  });
  const auto client = belt.connect();
  const auto endpoint = client.connect_pipe("orders", [](const Value&) {});
  const std::string large(8u * 1024 * 1024, 'x');
  for (int i = 0; i < 12; ++i) endpoint.send(Value(large));  // more than may wait
  client.call("settle");
  CHECK(belt.node.ask([&](Node&) { return packets; }) == 12);
  CHECK(belt.node.ask([&](Node&) { return items; }) == 12 * large.size());
}

TEST_CASE("handlers and values that do not fit a pipe are refused where they are set") {
  const auto service = Service::from_text({definition}, "belt", "Belt");
  const auto ignore = [](const PipeEndpoint&, std::string) {};
  CHECK_THAT(refusal([&] { service->pipe("parts").on_packet(ignore); }),
             Equals("test.belt.Belt.parts: packets are int16, the handler takes string"));
  CHECK_THAT(refusal([&] { service->pipe("scans").on_packet([](const PipeEndpoint&, Value) {}); }),
             Contains("readonly"));
  CHECK_THAT(refusal([&] { service->pipe("settle").on_connect([](const PipeEndpoint&) {}); }),
             Equals("test.belt.Belt.settle is a function, not a pipe"));
  CHECK_THAT(refusal([&] { service->pipe("orders").broadcast(Value("x")); }), Contains("writeonly"));
  CHECK_THAT(refusal([&] { service->pipe("parts").broadcast(Value("x")); }), Contains("test.belt.Belt.parts"));
  CHECK(service->pipe("parts").broadcast(Value(1)) == 0);
}
