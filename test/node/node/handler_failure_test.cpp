// Handlers that throw: an error for who called, a line in the report, and the connection goes on.
#include <algorithm>
#include <atomic>
#include <catch2/catch.hpp>
#include <mutex>

#include "node/client/async_object.hpp"
#include "test/node/node/node_fixture.hpp"

using namespace rr;
using namespace std::chrono_literals;
using Catch::Matchers::VectorContains;

namespace {

constexpr const char* definition = R"(service test.fragile
stdver 0.10
object Part
end
object Fragile
    property int32 level
    function int32 twice(int32 number)
    function int32{generator} count()
    function void stop_counting(int32{generator} numbers)
    function int32 ask(int32 number)
    event struck(int32 number)
    wire int32 both
    pipe int32 both_ways
    memory uint8[] cells
    callback int32 guess(int32 number)
    objref Part{int32} parts
end
)";

/// What a node or a client reports; any thread.
class Reports {
 public:
  std::function<void(const std::string&)> sink() {
    return [this](const std::string& problem) {
      const std::lock_guard lock(mutex_);
      texts_.push_back(problem);
    };
  }
  std::vector<std::string> texts() {
    const std::lock_guard lock(mutex_);
    return texts_;
  }

 private:
  std::mutex mutex_;
  std::vector<std::string> texts_;
};

/// Throws what is no std::exception where the number is negative.
std::int32_t twice(std::int32_t number) {
  if (number == 0) throw std::runtime_error("nothing to double");
  if (number < 0) throw number;
  return 2 * number;
}

std::shared_ptr<Service> make_fragile() {
  auto made = Service::from_text({definition}, "Fragile", "Fragile");
  auto* service = made.get();
  service->property("level").get([] { return twice(-1); }).set([](std::int32_t level) { twice(level); });
  service->function("twice", [service](std::int32_t number) {
    service->fire("struck", number);
    service->set_wire("both", number);
    service->pipe("both_ways").broadcast(number);
    return twice(number);
  });
  service->generator("count", [] { return [] { return std::optional<std::int32_t>(twice(-1)); }; });
  service->generator("stop_counting", [] { return [](std::int32_t) {}; });
  service->function("ask", [service](std::int32_t number) {
    service->call_callback(service->current_client(), "guess", {Value(number)}, [service](const Result<Value>& answer) {
      service->fire("struck", answer ? *answer->to<std::int32_t>() : -static_cast<std::int32_t>(answer.error().code));
    });
    return number;
  });
  service->on_wire("both", [](std::int32_t number) { twice(number); });
  service->pipe("both_ways").on_packet([](const PipeEndpoint&, std::int32_t number) { twice(number); });
  MemoryHandlers cells;
  cells.dimensions = [] { return MemoryShape{4}; };
  cells.read = [](const MemoryRange&) -> Value { throw 5; };
  cells.write = [](const MemoryRange&, const Value&) { throw std::runtime_error("read only glass"); };
  service->memory("cells", cells);
  service->objref("parts", [](std::string_view) -> std::shared_ptr<Object> { throw 6; });
  return made;
}

struct FragileNode {
  Reports reports;
  std::shared_ptr<Service> service = make_fragile();
  RunningNode node;

  explicit FragileNode(std::size_t max_clients = 16)
      : node([this](Node& made) { made.add(service); }, options(max_clients)) {}
  NodeOptions options(std::size_t max_clients) {
    NodeOptions made;
    made.report = reports.sink();
    made.max_clients = max_clients;
    return made;
  }
};

}  // namespace

TEST_CASE("a service's handlers may throw anything: each is an error for its client, who stays") {
  FragileNode device;
  const auto fragile = connect(device.node.url("Fragile"));
  const auto code_of = [&](auto&& work) { return error_of(work).code; };
  CHECK(code_of([&] { fragile.get("level"); }) == ErrorCode::remote_error);
  CHECK(code_of([&] { fragile.set("level", 0); }) == ErrorCode::remote_error);
  CHECK(code_of([&] { fragile.call("twice", -1); }) == ErrorCode::remote_error);
  CHECK(code_of([&] { fragile.generator("count").next(); }) == ErrorCode::remote_error);
  CHECK(code_of([&] { fragile.poke_out("both", -1); }) == ErrorCode::remote_error);
  const auto cells = fragile.memory("cells");
  CHECK(code_of([&] { cells.read({0}, {1}); }) == ErrorCode::remote_error);
  CHECK(error_of([&] { cells.write({0}, Value(std::vector<std::uint8_t>{1})); }).message == "read only glass");
  CHECK(code_of([&] { fragile.object("parts", "1"); }) == ErrorCode::object_not_found);
  fragile.connect_wire("both", [](const Value&, TimeSpec) {});
  fragile.send_wire("both", -1);
  const auto pipe = fragile.connect_pipe("both_ways", [](const Value&) {});
  pipe.send(Value(-1));
  CHECK(fragile.call("twice", 4) == Value(8));

  const std::string other = "an exception that is no std::exception";
  const auto failed = [](const std::string& what, const std::string& why) {
    return what + ": its handler failed: " + why;
  };
  CHECK(device.reports.texts() ==
        std::vector<std::string>{failed("property 'level'", other), failed("property 'level'", "nothing to double"),
                                 failed("function 'twice'", other), failed("function 'count'", other),
                                 failed("wire 'both'", other), failed("memory 'cells'", other),
                                 failed("memory 'cells'", "read only glass"), failed("objref 'parts'", other),
                                 failed("wire 'both'", other), failed("pipe 'both_ways'", other)});
}

TEST_CASE("a service that throws when clients come and go keeps them, and gives up their seats") {
  FragileNode device(1);
  device.service->on_client_connected([](ClientId) { throw std::runtime_error("who is that?"); });
  device.service->on_client_gone([](ClientId) { throw 7; });
  {
    const auto first = connect(device.node.url("Fragile"));
    CHECK(first.call("twice", 4) == Value(8));
  }
  const auto second = connect(device.node.url("Fragile"));  // the only seat
  CHECK(second.call("twice", 4) == Value(8));
  const auto reports = device.reports.texts();
  REQUIRE(reports.size() == 3);
  CHECK(reports[0] == "a client of service 'Fragile': its handler failed: who is that?");
  CHECK(reports[1] == "a lost client of service 'Fragile': its handler failed: an exception that is no std::exception");
}

TEST_CASE("a client's handlers may throw anything, and the connection goes on") {
  FragileNode device;
  Reports reports;
  ConnectOptions options;
  options.report = reports.sink();
  const auto fragile = connect(device.node.url("Fragile"), options);
  std::vector<std::int32_t> struck;
  fragile.on_event("struck", [&](std::span<const Value> arguments) {
    struck.push_back(*arguments.front().to<std::int32_t>());
    throw std::runtime_error("struck too hard");
  });
  fragile.connect_wire("both", [](const Value&, TimeSpec) { throw 1; });
  const auto pipe = fragile.connect_pipe("both_ways", [](const Value&) { throw 2; });
  fragile.on_callback("guess", [](std::int32_t number) -> std::int32_t {
    if (number == 1) throw ServiceException("no idea", ErrorCode::invalid_argument);
    throw number;
  });

  CHECK(fragile.call("twice", 4) == Value(8));
  CHECK(fragile.call("ask", 1) == Value(1));
  CHECK(fragile.call("ask", 2) == Value(2));
  const auto& connection = fragile.connection();
  REQUIRE(fragile.connection().run_until([&] { return struck.size() == 3; }, 5s));
  CHECK(struck ==
        std::vector{4, -static_cast<int>(ErrorCode::invalid_argument), -static_cast<int>(ErrorCode::remote_error)});

  const std::array<Value, 1> three{Value(3)};
  fragile.connection().asynchronous().call("Fragile", "twice", three, [](const Result<Value>&) { throw 3; });
  CHECK(fragile.call("twice", 5) == Value(10));
  CHECK_FALSE(connection.is_closed());
  const auto texts = reports.texts();
  const auto other = std::string(": its handler failed: an exception that is no std::exception");
  CHECK_THAT(texts, VectorContains(std::string("event 'struck': its handler failed: struck too hard")));
  for (const auto* what : {"wire 'both'", "pipe 'both_ways'", "callback 'guess'", "request to 'Fragile'"})
    CHECK_THAT(texts, VectorContains(what + other));
}

TEST_CASE("handlers that throw when a connection opens or ends are reported") {
  FragileNode device;
  Reports reports;
  ConnectOptions options;
  options.report = reports.sink();
  boost::asio::io_context io;
  std::shared_ptr<ClientConnection> connection;
  bool is_lost = false;
  ClientConnection::open(io, device.node.url("Fragile"), options, [&](const auto& opened) {
    connection = opened.value();
    connection->on_closed([](const Error&) { throw 4; });
    connection->on_closed([&](const Error&) { is_lost = true; });
    throw std::runtime_error("not now");
  });
  while (reports.texts().empty() && io.run_one() != 0) {
  }
  connection->disconnect();
  io.run();
  CHECK(is_lost);
  CHECK(reports.texts() ==
        std::vector<std::string>{"connecting to 'Fragile': its handler failed: not now",
                                 "the end of 'Fragile': its handler failed: an exception that is no std::exception"});
}

TEST_CASE("what a node runs by itself may throw anything: it is reported, and the node goes on") {
  Reports reports;
  std::atomic<int> rounds = 0;
  NodeOptions options;
  options.report = reports.sink();
  RunningNode device(
      [&](Node& made) {
        made.every(1ms, [&] {
          if (++rounds <= 2) throw std::runtime_error("out of step");
        });
      },
      options);
  device.ask([](Node& node) {
    node.post([] { throw 7; });
    return 0;
  });
  while (rounds < 4) CHECK(device.ask([](Node&) { return 7; }) == 7);  // its thread runs
  auto texts = reports.texts();
  std::sort(texts.begin(), texts.end());
  const auto late = "Node 'every': its handler failed: out of step";
  CHECK(texts == std::vector<std::string>{late, late,
                                          "Node 'post': its handler failed: an exception that is no std::exception"});
}
