#include "node/service/node.hpp"

#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/read.hpp>
#include <boost/asio/write.hpp>
#include <catch2/catch.hpp>

#include "core/session/client/client_session.hpp"
#include "core/support/random.hpp"
#include "core/wire/frame_scanner.hpp"
#include "node/driver/clocks.hpp"
#include "test/node/node/node_fixture.hpp"

using namespace rr;
using namespace std::chrono_literals;
using Catch::Matchers::Contains;

namespace {

constexpr const char* definition = R"(service test.counter
stdver 0.10

exception CounterBroken

object Digit
    property int32 value
end

object Counter
    property int32 count
    property double[] samples
    function int32 add(int32 amount)
    function void fail(string how)
    function uint64 who()
    function varvalue echo(varvalue value)
    event counted(int32 count)
    event sampled(double[] samples)
    wire int32 newest [readonly]
    wire double[] trace [readonly]
    wire double wish [writeonly]
    wire double both
    property double wished [readonly]
    objref Digit{int32} digits
    objref Digit first
    function void replace_first()
    pipe double stream
end
)";

/// The counter's service and what is behind it; used on the node's thread.
struct Counter {
  std::shared_ptr<Service> service = Service::from_text({definition}, "Counter", "Counter");
  std::int32_t count = 0;
  double wished = 0;
  std::vector<double> samples;
  std::vector<ClientId> connected;
  std::vector<ClientId> gone;

  explicit Counter(Node& node, const Value& trace = {}) {
    if (!trace.is_null()) service->set_wire("trace", trace);
    service->property("count").get([this] { return count; }).set([this](std::int32_t value) { count = value; });
    service->property("samples").get([this] { return samples; }).set([this](std::vector<double> values) {
      samples = std::move(values);
    });
    service->function("add", [this](std::int32_t amount) {
      count += amount;
      service->fire("counted", count);
      service->set_wire("newest", count);
      return count;
    });
    service->function("fail", [](const std::string& how) {
      if (how == "custom") throw ServiceException("test.counter.CounterBroken", "it broke", "wheel", Value(7));
      if (how == "code") throw ServiceException("not now", ErrorCode::invalid_operation);
      if (how == "standard") throw std::runtime_error("surprise");
    });
    service->function("who", [this] { return service->current_client(); });
    service->function("echo", [](Value value) { return value; });
    service->property("wished").get([this] { return wished; });
    service->on_wire("wish", [this](double value) { wished = value; });
    service->on_wire("both", [this](double value) {
      if (value < 0) throw std::runtime_error("negative");
      service->set_wire("both", 2 * value);
    });
    service->objref("digits", [this](std::string_view index) {
      if (index == "6") throw ServiceException("no digit 6", ErrorCode::object_not_found);
      return index == "4" ? make_digit(4) : nullptr;
    });
    service->objref("first", make_digit(1));
    service->function("replace_first", [this] { service->objref("first", make_digit(100)); });
    service->on_client_connected([this](ClientId id) { connected.push_back(id); });
    service->on_client_gone([this](ClientId id) { gone.push_back(id); });
    node.add(service);
  }

  std::shared_ptr<Object> make_digit(std::int32_t value) {
    auto digit = service->make_object("Digit");
    auto stored = std::make_shared<std::int32_t>(value);
    digit->property("value").get([stored] { return *stored; }).set([stored](std::int32_t other) { *stored = other; });
    return digit;
  }
};

struct CounterNode {
  std::unique_ptr<Counter> counter;
  RunningNode node;
  explicit CounterNode(NodeOptions options = {})
      : node([this](Node& made) { counter = std::make_unique<Counter>(made); }, std::move(options)) {}
  RemoteObject connect(ClientOptions options = {}) { return rr::connect(node.url("Counter"), std::move(options)); }
};

ClientOptions with_features(Features features) {
  ClientOptions options;
  options.connection.features = features;
  return options;
}

/// The time that a peek of the counter's wire is answered with, which clients of the library do not hand on.
std::int64_t peeked_seconds(std::uint16_t port, std::string_view wire) {
  boost::asio::io_context io;
  boost::asio::ip::tcp::socket socket(io);
  socket.connect({boost::asio::ip::make_address("127.0.0.1"), port});
  ClientOptions options = with_features(legacy_features);
  options.service = "Counter";
  options.connection.self.id = random_node_id();
  ClientSession session(std::move(options), read_clocks());
  FrameScanner scanner;
  Message message;
  std::array<std::uint8_t, 4096> buffer{};
  while (true) {
    while (const auto event = session.poll_event())
      if (std::holds_alternative<Connected>(*event)) session.peek_in_value("Counter", wire, read_clocks());
    std::size_t written = 0;
    for (const auto& slice : session.poll_transmit())
      written += boost::asio::write(socket, boost::asio::buffer(slice.data(), slice.size()));
    session.handle_transmitted(written, read_clocks());
    auto input = ByteSpan(buffer).first(socket.read_some(boost::asio::buffer(buffer)));
    session.handle_bytes(input, read_clocks());
    while (!input.empty()) {
      input = input.subspan(scanner.feed(input).value());
      if (!scanner.message()) continue;
      REQUIRE(decode(*scanner.message(), {}, message).has_value());
      const auto& entry = message.entries.front();
      if (entry.type != EntryType::wire_peek_in_value_ret) continue;
      const auto* time = message.elements_of(entry).find("packettime");
      return load<std::int64_t>(message.children_of(*time).find("seconds")->data.data());
    }
  }
}

}  // namespace

TEST_CASE("functions and properties, at every level of the protocol") {
  const Features v2{.combined_v2 = true, .v4 = false};
  const Features old_v2{.combined_v2 = false, .v4 = false};
  const Features v4{.string_table = {.local = false, .standard = false}};
  const Features all = {};
  const Features levels[] = {v2, old_v2, v4, all};
  const auto features = levels[GENERATE(0, 1, 2, 3)];
  CounterNode device;
  const auto counter = device.connect(with_features(features));
  CHECK(counter.connection().asynchronous().session().connection().features().v4 == features.v4);
  CHECK(counter.type_name() == "test.counter.Counter");
  CHECK(counter.call("add", 5) == Value(5));
  CHECK(counter.call("add", -2) == Value(3));
  counter.set("count", 41);
  CHECK(counter.get("count") == Value(41));
  counter.set("samples", std::vector<double>{1, 2.5});
  CHECK(counter.get("samples") == Value(std::vector<double>{1, 2.5}));
  CHECK(counter.call("echo", "text") == Value("text"));
}

TEST_CASE("a large array passes both ways") {
  CounterNode device;
  const auto counter = device.connect();
  std::vector<double> samples(1'300'000);
  for (std::size_t i = 0; i < samples.size(); ++i) samples[i] = static_cast<double>(i);
  counter.set("samples", samples);
  CHECK(counter.get("samples") == Value(samples));
}

TEST_CASE("errors of handlers reach the client") {
  CounterNode device;
  const auto counter = device.connect();
  const auto custom = error_of([&] { counter.call("fail", "custom"); });
  CHECK(custom.code == ErrorCode::remote_error);
  CHECK(custom.qualified_name() == "test.counter.CounterBroken");
  CHECK(custom.message == "it broke");
  CHECK(custom.sub_name == "wheel");
  REQUIRE(custom.param);
  CHECK(custom.param->to<std::int32_t>().value() == 7);

  const auto code = error_of([&] { counter.call("fail", "code"); });
  CHECK(code.code == ErrorCode::invalid_operation);
  CHECK(code.message == "not now");

  const auto standard = error_of([&] { counter.call("fail", "standard"); });
  CHECK(standard.code == ErrorCode::remote_error);
  CHECK(standard.qualified_name() == "rrgate.UnhandledException");
  CHECK(standard.message == "surprise");

  CHECK_NOTHROW(counter.call("fail", "not at all"));
}

TEST_CASE("requests that the definition does not allow fail by name") {
  CounterNode device;
  const auto counter = device.connect();
  CHECK(error_of([&] { counter.call("subtract", 1); }).code == ErrorCode::member_not_found);
  CHECK(error_of([&] { counter.call("add", "one"); }).code == ErrorCode::data_type_mismatch);
  CHECK(error_of([&] { counter.call("add"); }).code == ErrorCode::invalid_argument);
  CHECK(error_of([&] { counter.set("wished", 1.0); }).code == ErrorCode::read_only_member);
  CHECK(counter.call("add", 1) == Value(1));
}

TEST_CASE("events reach every client, in order") {
  CounterNode device;
  const auto one = device.connect();
  const auto two = device.connect();
  std::vector<Value> seen_by_one, seen_by_two;
  one.on_event("counted", [&](std::span<const Value> arguments) { seen_by_one.push_back(arguments.front()); });
  two.on_event("counted", [&](std::span<const Value> arguments) { seen_by_two.push_back(arguments.front()); });
  for (int i = 0; i < 10; ++i) one.call("add", 1);
  REQUIRE(two.connection().run_until([&] { return seen_by_two.size() == 10; }, 5s));
  CHECK(seen_by_one == seen_by_two);
  CHECK(seen_by_two.front() == Value(1));
  CHECK(seen_by_two.back() == Value(10));
}

TEST_CASE("wires: the present value at once, newer ones as they come, peeks without a connection") {
  CounterNode device;
  const auto counter = device.connect();
  CHECK(error_of([&] { counter.peek_in("newest"); }).code == ErrorCode::value_not_set);
  counter.call("add", 5);
  CHECK(counter.peek_in("newest") == Value(5));

  std::vector<Value> seen;
  counter.connect_wire("newest", [&](const Value& value, TimeSpec) { seen.push_back(value); });
  REQUIRE(counter.connection().run_until([&] { return seen.size() == 1; }, 5s));
  CHECK(seen.front() == Value(5));
  counter.call("add", 1);
  REQUIRE(counter.connection().run_until([&] { return seen.size() == 2; }, 5s));
  CHECK(seen.back() == Value(6));
  counter.disconnect_wire("newest");
  counter.call("add", 1);
  counter.call("add", 1);
  CHECK(seen.size() == 2);
}

TEST_CASE("a wire that is reset has no value until it is set again; clients that follow it keep theirs") {
  CounterNode device;
  const auto one = device.connect();
  const auto two = device.connect();
  one.call("add", 5);
  std::vector<Value> seen_by_one, seen_by_two;
  one.connect_wire("newest", [&](const Value& value, TimeSpec) { seen_by_one.push_back(value); });
  REQUIRE(one.connection().run_until([&] { return seen_by_one.size() == 1; }, 5s));
  const auto id = *one.call("who").to<std::uint64_t>();
  device.node.ask([&](Node&) {
    auto& root = device.counter->service->root();
    root.set_wire_for(id, "newest", 50);
    root.reset_wire("newest");
    CHECK_THAT(refusal([&] { root.reset_wire("nonesuch"); }), Contains("nonesuch"));
    return 0;
  });
  CHECK(error_of([&] { one.peek_in("newest"); }).code == ErrorCode::value_not_set);
  two.connect_wire("newest", [&](const Value& value, TimeSpec) { seen_by_two.push_back(value); });
  one.call("add", 1);
  REQUIRE(two.connection().run_until([&] { return seen_by_two.size() == 1; }, 5s));
  CHECK(seen_by_two.front() == Value(6));
  REQUIRE(one.connection().run_until([&] { return seen_by_one.size() == 3; }, 5s));
  CHECK(seen_by_one == std::vector<Value>{Value(5), Value(50), Value(6)});
}

TEST_CASE("a peek has the time that the value was set with; where there is none, that of the peek") {
  CounterNode device;
  const auto counter = device.connect();
  const auto id = *counter.call("who").to<std::uint64_t>();
  const auto change = [&](const auto& how) {
    device.node.ask([&](Node&) { return how(device.counter->service->root()), 0; });
  };
  const auto now = read_clocks().utc.seconds;
  change([](Object& root) { root.set_wire("newest", 5, TimeSpec{1000, 0}); });
  CHECK(peeked_seconds(device.node.port(), "newest") == 1000);
  change([&](Object& root) { root.set_wire_for(id, "newest", 6); });
  CHECK(peeked_seconds(device.node.port(), "newest") == 1000);  // another client
  change([](Object& root) { root.set_wire("newest", 7); });
  CHECK(peeked_seconds(device.node.port(), "newest") >= now);
}

TEST_CASE("a wire is sent to who follows it now: clients leave, come back and vanish") {
  CounterNode device;
  const auto staying = device.connect();
  auto leaving = device.connect();
  std::vector<Value> seen_by_staying, seen_by_leaving;
  staying.connect_wire("newest", [&](const Value& value, TimeSpec) { seen_by_staying.push_back(value); });
  leaving.connect_wire("newest", [&](const Value& value, TimeSpec) { seen_by_leaving.push_back(value); });
  const auto add = [&](std::size_t seen) {
    staying.call("add", 1);
    REQUIRE(staying.connection().run_until([&] { return seen_by_staying.size() == seen; }, 5s));
  };
  add(1);
  REQUIRE(leaving.connection().run_until([&] { return seen_by_leaving.size() == 1; }, 5s));
  leaving.disconnect_wire("newest");
  add(2);
  leaving.connect_wire("newest", [&](const Value& value, TimeSpec) { seen_by_leaving.push_back(value); });
  add(3);
  REQUIRE(leaving.connection().run_until([&] { return seen_by_leaving.size() == 3; }, 5s));
  CHECK(seen_by_leaving == std::vector<Value>{Value(1), Value(2), Value(3)});
  leaving.connection().close();
  add(4);
  add(5);
  CHECK(seen_by_staying.back() == Value(5));
}

TEST_CASE("an object that is looked up anew has its wires connected anew") {
  CounterNode device;
  auto counter = device.connect();
  const auto newest = [&](std::int32_t value) {
    device.node.ask([&](Node&) { return device.counter->service->set_wire("newest", value), 0; });
  };
  std::vector<Value> seen;
  counter.connect_wire("newest", [&](const Value& value, TimeSpec) { seen.push_back(value); });
  newest(1);
  counter.call("replace_first");  // releases another path
  newest(2);
  REQUIRE(counter.connection().run_until([&] { return seen.size() == 2; }, 5s));
  CHECK(seen == std::vector<Value>{Value(1), Value(2)});
}

TEST_CASE("a wire's value for one client alone: sent, peeked, kept for when it connects, until all have a new one") {
  CounterNode device;
  const auto one = device.connect();
  const auto two = device.connect();
  const auto id = *one.call("who").to<std::uint64_t>();
  one.call("add", 5);
  std::vector<Value> seen_by_one, seen_by_two;
  two.connect_wire("newest", [&](const Value& value, TimeSpec) { seen_by_two.push_back(value); });
  const auto set_for = [&](std::int32_t value) {
    device.node.ask([&](Node&) { return device.counter->service->set_wire_for(id, "newest", value), 0; });
  };
  set_for(50);
  CHECK(one.peek_in("newest") == Value(50));
  CHECK(two.peek_in("newest") == Value(5));
  one.connect_wire("newest", [&](const Value& value, TimeSpec) { seen_by_one.push_back(value); });
  REQUIRE(one.connection().run_until([&] { return seen_by_one.size() == 1; }, 5s));
  set_for(51);
  REQUIRE(one.connection().run_until([&] { return seen_by_one.size() == 2; }, 5s));
  one.call("add", 1);
  REQUIRE(one.connection().run_until([&] { return seen_by_one.size() == 3; }, 5s));
  CHECK(seen_by_one == std::vector<Value>{Value(50), Value(51), Value(6)});
  CHECK(one.peek_in("newest") == Value(6));
  REQUIRE(two.connection().run_until([&] { return seen_by_two.size() == 2; }, 5s));
  CHECK(seen_by_two == std::vector<Value>{Value(5), Value(6)});
  device.node.ask([&](Node&) {
    auto& service = *device.counter->service;
    CHECK_THAT(refusal([&] { service.set_wire_for(id, "wish", 1.0); }), Contains("writeonly"));
    CHECK_THAT(refusal([&] { service.set_wire_for(id, "newest", "text"); }), Contains("newest"));
    CHECK_NOTHROW(service.set_wire_for(id + 100, "newest", 1));
    return 0;
  });
}

TEST_CASE("wires towards the service: sent, poked, answered") {
  CounterNode device;
  const auto counter = device.connect();
  counter.connect_wire("wish", [](const Value&, TimeSpec) {});
  counter.send_wire("wish", 2.5);
  CHECK(counter.get("wished") == Value(2.5));

  std::vector<Value> seen;
  counter.connect_wire("both", [&](const Value& value, TimeSpec) { seen.push_back(value); });
  counter.send_wire("both", 4.0);
  REQUIRE(counter.connection().run_until([&] { return !seen.empty(); }, 5s));
  CHECK(seen.back() == Value(8.0));
  CHECK(counter.peek_out("both") == Value(4.0));
  counter.poke_out("both", 5.0);
  CHECK(counter.peek_in("both") == Value(10.0));
  CHECK(counter.peek_out("both") == Value(5.0));
}

TEST_CASE("a wire handler that fails is reported, and the client stays") {
  std::promise<std::string> reported;
  int reports = 0;
  NodeOptions options;
  options.report = [&](const std::string& problem) {
    if (++reports == 1) reported.set_value(problem);
  };
  CounterNode device(std::move(options));
  const auto counter = device.connect();
  counter.connect_wire("both", [](const Value&, TimeSpec) {});
  counter.send_wire("both", -1.0);
  auto problem = reported.get_future();
  REQUIRE(problem.wait_for(5s) == std::future_status::ready);
  CHECK(problem.get() == "wire 'both': its handler failed: negative");
  CHECK(error_of([&] { counter.poke_out("both", -1.0); }).message == "negative");
  CHECK(counter.call("add", 1) == Value(1));
  CHECK(device.node.ask([&](Node&) { return reports; }) == 2);
}

TEST_CASE("what is too large for a message is refused where it is fired or set, and the wire keeps its value") {
  CounterNode device;
  const auto counter = device.connect();
  const auto length = [](const Value& value) { return value.to_items<double>().value().size(); };
  std::vector<std::size_t> events, values;
  counter.on_event("sampled", [&](std::span<const Value> samples) { events.push_back(length(samples[0])); });
  counter.connect_wire("trace", [&](const Value& value, TimeSpec) { values.push_back(length(value)); });
  const Value large(std::vector<double>(12 * 1024 * 1024 / 8 - 1000));
  const Value too_large(std::vector<double>(12 * 1024 * 1024 / 8));
  device.node.ask([&](Node&) {
    auto& service = *device.counter->service;
    service.fire("sampled", large);
    service.set_wire("trace", large);
    const auto why = Contains("bytes are too large for a message");
    CHECK_THAT(refusal([&] { service.fire("sampled", too_large); }), why);
    CHECK_THAT(refusal([&] { service.set_wire("trace", too_large); }), why);
    CHECK_THAT(refusal([&] { service.set_wire_for(device.counter->connected.front(), "trace", too_large); }), why);
    return 0;
  });
  REQUIRE(counter.connection().run_until([&] { return !events.empty() && !values.empty(); }, 5s));
  CHECK(length(counter.peek_in("trace")) == length(large));
  CHECK(events == std::vector{length(large)});
  CHECK(values == std::vector{length(large)});
}

TEST_CASE("a wire that was set too large before its node was known says so to who connects it") {
  std::vector<std::string> reports;
  NodeOptions options;
  options.max_message_size = 1024 * 1024;
  options.report = [&](const std::string& problem) { reports.push_back(problem); };
  std::unique_ptr<Counter> counter;
  const auto prepare = [&](Node& made) {
    counter = std::make_unique<Counter>(made, Value(std::vector<double>(1024 * 1024 / 8)));
  };
  RunningNode node(prepare, std::move(options));
  const auto remote = rr::connect(node.url("Counter"));
  remote.connect_wire("trace", [](const Value&, TimeSpec) {});
  CHECK(remote.call("add", 1) == Value(1));
  const auto heard = node.ask([&](Node&) { return reports; });
  REQUIRE(heard.size() == 1);
  CHECK_THAT(heard.front(), Contains("wire 'trace'") && Contains("limit"));
}

TEST_CASE("an object is found although what its wire was set to before is too large for a message") {
  NodeOptions options;
  options.max_message_size = 1024 * 1024;
  const auto service = Service::from_text({R"(service test.large
object Leaf
    wire double[] trace [readonly]
    function int32 three()
end
object Root
    objref Leaf{int32} leaves
end
)"},
                                          "large", "Root");
  service->objref("leaves", [&](std::string_view) {
    auto leaf = service->make_object("Leaf");
    leaf->function("three", [] { return 3; });
    leaf->set_wire("trace", Value(std::vector<double>(1024 * 1024 / 8)));
    return leaf;
  });
  RunningNode node([&](Node& made) { made.add(service); }, std::move(options));
  CHECK(rr::connect(node.url("large")).object("leaves", "1").call("three") == Value(3));
}

TEST_CASE("objects are found by index and looked up anew when they are replaced") {
  CounterNode device;
  const auto counter = device.connect();
  const auto digit = counter.object("digits", "4");
  CHECK(digit.type_name() == "test.counter.Digit");
  CHECK(digit.get("value") == Value(4));
  digit.set("value", 8);
  CHECK(counter.object("digits", "4").get("value") == Value(8));
  CHECK(error_of([&] { counter.object("digits", "5"); }).code == ErrorCode::service_error);
  CHECK(error_of([&] { counter.object("digits", "6"); }).message == "no digit 6");

  const auto first = counter.object("first");
  CHECK(first.get("value") == Value(1));
  counter.call("replace_first");
  CHECK(error_of([&] { first.get("value"); }).code == ErrorCode::object_not_found);
  CHECK(counter.object("first").get("value") == Value(100));
}

TEST_CASE("handlers know the client, and hear when it is gone") {
  CounterNode device;
  const auto one = device.connect();
  const auto id = one.call("who");
  {
    const auto two = device.connect();
    CHECK(two.call("who") != id);
    CHECK(one.call("who") == id);
  }
  REQUIRE(one.connection().run_until(
      [&] { return device.node.ask([&](Node&) { return device.counter->gone.size(); }) == 1; }, 5s));
  device.node.ask([&](Node& node) {
    CHECK(device.counter->connected.size() == 2);
    CHECK(device.counter->gone.front() == device.counter->connected.back());
    CHECK(device.counter->service->current_client() == 0);
    CHECK(node.client_count() == 1);
    return 0;
  });
}

TEST_CASE("members of kinds to come are refused without harm") {
  CounterNode device;
  const auto counter = device.connect();
  CHECK(error_of([&] { counter.get("stream"); }).code == ErrorCode::member_not_found);
  CHECK(counter.call("add", 1) == Value(1));
}

TEST_CASE("stopping tells the clients; run() returns") {
  CounterNode device;
  const auto counter = device.connect();
  device.node.stop();
  device.node.join();
  CHECK(error_of([&] { counter.call("add", 1); }).code != ErrorCode::none);
  CHECK(counter.connection().is_closed());
}

TEST_CASE("a node whose run was ended by an exception runs again, or stops") {
  Node one("test.one"), other("test.other");
  for (auto* node : {&one, &other}) {
    boost::asio::post(node->io_context(), [] { throw std::runtime_error("not of the node"); });
    CHECK_THROWS_WITH(node->run(), "not of the node");
  }
  boost::asio::post(one.io_context(), [&] { one.stop(); });
  one.run();
  other.stop();
}

TEST_CASE("garbage closes that connection and no other") {
  CounterNode device;
  const auto counter = device.connect();
  boost::asio::io_context io;
  boost::asio::ip::tcp::socket socket(io);
  socket.connect({boost::asio::ip::make_address("127.0.0.1"), device.node.port()});
  boost::asio::write(socket, boost::asio::buffer("GET / HTTP/1.1\r\nHost: x\r\n\r\n", 27));
  std::array<char, 1024> rest{};
  boost::system::error_code error;
  boost::asio::read(socket, boost::asio::buffer(rest), error);
  CHECK((error == boost::asio::error::eof || error == boost::asio::error::connection_reset));
  CHECK(counter.call("add", 1) == Value(1));
}

TEST_CASE("connections above the limit are closed at once") {
  NodeOptions options;
  options.max_clients = 1;
  CounterNode device(std::move(options));
  {
    const auto counter = device.connect();
    CHECK(error_of([&] { device.connect(); }).code == ErrorCode::connection_error);
    CHECK(counter.call("add", 1) == Value(1));
  }
}

TEST_CASE("every() repeats without drift and ends with the node") {
  Node node("");
  int runs = 0;
  std::chrono::steady_clock::time_point start = std::chrono::steady_clock::now();
  node.every(2ms, [&] {
    if (++runs == 20) node.stop();
  });
  node.run();
  CHECK(runs == 20);
  CHECK(std::chrono::steady_clock::now() - start >= 40ms);
  CHECK_THROWS_AS(node.every(0ms, [] {}), std::invalid_argument);
}

TEST_CASE("a node listens on IPv6 as well, and says why it cannot") {
  Node node("test.node");
  const auto port = node.listen("rr+tcp://127.0.0.1:0/");
  CHECK(port != 0);
  CHECK_NOTHROW(node.listen("rr+tcp://[::1]:0"));
  CHECK_NOTHROW(node.listen("rr+tcp://localhost:0"));
  try {
    node.listen("rr+tcp://127.0.0.1:" + std::to_string(port));
    FAIL("listened twice on one port");
  } catch (const std::runtime_error& error) {
    CHECK_THAT(error.what(), Contains("listen on 127.0.0.1:" + std::to_string(port) + ": Address already in use"));
  }
  CHECK_THROWS_WITH(node.listen("rr+ws://127.0.0.1:0"), Contains("rr+tcp://HOST:PORT"));
  CHECK_THROWS_AS(node.listen("rr+tcp://127.0.0.1"), std::invalid_argument);
  CHECK_THROWS_WITH(Node("not a name"), Contains("'not a name'"));
}

TEST_CASE("a node on somebody else's io_context goes away while clients are connected") {
  boost::asio::io_context io;
  auto node = std::make_unique<Node>(io, "test.node");
  const Counter counter(*node);
  const auto url = "rr+tcp://127.0.0.1:" + std::to_string(node->listen("rr+tcp://127.0.0.1:0")) + "/?service=Counter";
  bool is_open = false;
  bool is_lost = false;
  ClientConnection::open(io, url, {}, [&](Result<std::shared_ptr<ClientConnection>> opened) {
    REQUIRE(opened.has_value());
    is_open = true;
    (*opened)->on_closed([&](const Error&) { is_lost = true; });
    node.reset();
  });
  while (!is_lost && io.run_one() != 0) {
  }
  CHECK(is_open);
  CHECK(is_lost);
  CHECK(counter.gone.empty());
  io.run();
}

TEST_CASE("a node may go while somebody who has connected says nothing yet: he is let go at once") {
  boost::asio::io_context io;
  auto node = std::make_unique<Node>(io, "test.node");
  const auto port = node->listen("rr+tcp://127.0.0.1:0");
  boost::asio::ip::tcp::socket silent(io);
  silent.connect({boost::asio::ip::make_address("127.0.0.1"), port});
  io.poll();
  io.poll();
  node.reset();
  bool is_let_go = false;
  char byte = 0;
  silent.async_read_some(boost::asio::buffer(&byte, 1),
                         [&](const boost::system::error_code& error, std::size_t) { is_let_go = bool(error); });
  io.run_for(2s);  // a node waits for 5 s
  CHECK(is_let_go);
}
