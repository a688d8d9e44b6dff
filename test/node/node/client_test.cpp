#include "node/client/client.hpp"

#include <algorithm>
#include <atomic>
#include <boost/asio/ip/tcp.hpp>
#include <catch2/catch.hpp>
#include <thread>

#include "core/session/service/subscription_losses.hpp"
#include "test/node/node/node_fixture.hpp"

using namespace rr;
using namespace std::chrono_literals;
using Catch::Matchers::Contains;
using Catch::Matchers::Equals;

namespace {

constexpr const char* definition = R"(service test.echo
stdver 0.10
object Echo
    function string say(string text)
    function void provoke()
    function void flood()
    event said(string text)
    wire int32 count
    pipe string words
    callback int32 ask(string question)
end
)";

std::shared_ptr<Service> add_echo(Node& node) {
  auto service = Service::from_text({definition}, "Echo", "Echo");
  service->function("say", [service = service.get()](std::string text) {
    service->fire("said", text);
    return text;
  });
  // The callback's answer comes by the wire.
  service->function("provoke", [service = service.get()] {
    service->set_wire("count", 4);
    service->pipe("words").broadcast(Value("word"));
    service->call_callback(service->current_client(), "ask", {Value("how many?")},
                           [service](const Result<Value>& answer) {
                             if (answer) service->set_wire("count", *answer);
                           });
  });
  service->function("flood", [service = service.get()] {
    const Value packet(std::string(1024 * 1024, 'x'));
    for (int i = 0; i < 16; ++i) service->pipe("words").broadcast(packet);
  });
  service->set_wire("count", 5);
  node.add(service);
  return service;
}

}  // namespace

TEST_CASE("a varvalue may be of a definition that the service's own does not import") {
  RunningNode node([](Node& device) {
    auto service = Service::from_text({"service test.unit\nstdver 0.10\nstruct Unit\n    field string name\nend\n",
                                       "service test.any\nstdver 0.10\nobject Any\n"
                                       "    property varvalue unit [readonly]\nend\n"},
                                      "Any", "Any");
    service->property("unit").get([] { return Value(Structure{"test.unit.Unit", {{"name", Value("mm")}}}); });
    device.add(service);
  });
  CHECK(connect(node.url("Any")).get("unit") == Value(Structure{"test.unit.Unit", {{"name", Value("mm")}}}));
}

TEST_CASE("connecting fails with a reason") {
  RunningNode node(add_echo);
  CHECK(error_of([&] { connect(node.url("Nothing")); }).code == ErrorCode::service_not_found);
  CHECK_THAT(error_of([&] { connect("rr+tcp://127.0.0.1:1/?service=Echo"); }).message,
             Equals("connect to 127.0.0.1:1: Connection refused"));
  CHECK_THAT(error_of([&] { connect("rr+usb:///?service=Echo"); }).message, Contains("rr+usb"));
  CHECK_THAT(error_of([&] { connect("nonsense"); }).message, Contains("nonsense"));
  const auto other_node = node.url("Echo") + "&nodeid=11111111-2222-3333-4444-555555555555";
  CHECK(error_of([&] { connect(other_node); }).code == ErrorCode::node_not_found);
  CHECK_NOTHROW(connect(node.url("Echo") + "&nodename=test.node"));
}

TEST_CASE("a server that never says anything is given up") {
  boost::asio::io_context io;
  boost::asio::ip::tcp::acceptor acceptor(io, {boost::asio::ip::make_address("127.0.0.1"), 0});
  ClientOptions options;
  options.connect_timeout = 50ms;
  const auto error = error_of([&] {
    connect("rr+tcp://127.0.0.1:" + std::to_string(acceptor.local_endpoint().port()) + "/?service=Echo", options);
  });
  CHECK(error.code != ErrorCode::none);
}

TEST_CASE("the longest time is long: to connect, to answer and to wait") {
  constexpr auto longest = std::chrono::milliseconds::max();
  RunningNode node(add_echo);
  ConnectOptions options;
  options.connect_timeout = longest;
  options.request_timeout = longest;
  options.heartbeat = Heartbeat{longest, longest};
  const auto echo = connect(node.url("Echo"), options);
  CHECK(echo.call("say", "x") == Value("x"));
  std::vector<Value> values;
  echo.connect_wire("count", [&](const Value& value, TimeSpec) {
    values.push_back(value);
    echo.connection().asynchronous().close(make_error(ErrorCode::connection_error, "enough"));
  });
  echo.connection().run_for(longest);
  CHECK(values == std::vector{Value(5)});
}

TEST_CASE("a lost connection fails what is pending, and everything after it") {
  RunningNode node(add_echo);
  const auto echo = connect(node.url("Echo"));
  auto& connection = echo.connection().asynchronous();
  std::vector<ErrorCode> codes;
  const std::array<Value, 1> arguments{Value("x")};
  connection.call("Echo", "say", arguments,
                  [&](Result<Value> result) { codes.push_back(result ? ErrorCode::none : result.error().code); });
  connection.close(make_error(ErrorCode::connection_error, "cut"));
  CHECK(codes == std::vector{ErrorCode::connection_error});
  CHECK(error_of([&] { echo.call("say", "y"); }).message == "cut");
}

TEST_CASE("a client hears what became of the values of its wire") {
  RunningNode node(add_echo);
  const auto echo = connect(node.url("Echo"));
  const auto losses = [&] {
    const Value attributes = echo.connection().wait_for(
        [](ClientConnection& connection, auto done) { connection.get_attributes(std::move(done)); });
    return read_losses(attributes, "Echo", "count");
  };
  CHECK_FALSE(losses());
  int values = 0;
  echo.connect_wire("count", [&](const Value&, TimeSpec) { ++values; });
  REQUIRE(echo.connection().run_until([&] { return values > 0; }, 5s));
  REQUIRE(losses());
  CHECK(losses()->delivered == 1);
  CHECK(losses()->conflated == 0);
}

TEST_CASE("handlers may make requests and wait for them; one is called after the other") {
  RunningNode node(add_echo);
  const auto echo = connect(node.url("Echo"));
  std::vector<std::string> said;
  int running = 0;
  echo.on_event("said", [&](std::span<const Value> arguments) {
    CHECK(++running == 1);
    said.emplace_back(*arguments.front().to_text());
    if (said.size() == 1) CHECK(echo.call("say", "two") == Value("two"));
    --running;
  });
  CHECK(echo.call("say", "one") == Value("one"));
  REQUIRE(echo.connection().run_until([&] { return said.size() == 2; }, 5s));
  CHECK(said == std::vector<std::string>{"one", "two"});
}

TEST_CASE("handlers of wires, pipes and callbacks may wait as well") {
  RunningNode node(add_echo);
  const auto echo = connect(node.url("Echo"));
  std::vector<std::string> answers;
  const auto ask = [&](const std::string& text) { answers.emplace_back(*echo.call("say", text).to_text()); };
  echo.connect_wire("count", [&](const Value&, TimeSpec) { ask("of the wire"); });
  const auto pipe = echo.connect_pipe("words", [&](const Value&) { ask("of the pipe"); });
  echo.on_callback("ask", [&](const std::string&) {
    ask("of the callback");
    return 5;
  });
  echo.call("provoke");
  REQUIRE(echo.connection().run_until([&] { return answers.size() >= 4; }, 5s));
  CHECK(std::count(answers.begin(), answers.end(), "of the pipe") == 1);
  CHECK(std::count(answers.begin(), answers.end(), "of the callback") == 1);
  REQUIRE(echo.connection().run_until([&] { return echo.peek_in("count") == Value(5); }, 5s));  // what it answered
}

TEST_CASE("a handler that ends its wire or pipe hears no more of it") {
  RunningNode node(add_echo);
  const auto echo = connect(node.url("Echo"));
  int values = 0;
  int packets = 0;
  std::optional<RemotePipe> pipe;
  echo.connect_wire("count", [&](const Value&, TimeSpec) {
    ++values;
    echo.disconnect_wire("count");
  });
  pipe = echo.connect_pipe("words", [&](const Value&) {
    ++packets;
    echo.call("provoke");  // more packets
    pipe->close();
  });
  echo.call("provoke");
  echo.call("provoke");
  REQUIRE(echo.connection().run_until([&] { return packets > 0; }, 5s));
  echo.call("provoke");
  CHECK(values == 1);
  CHECK(packets == 1);
}

TEST_CASE("asynchronous handlers may use the connection, but not wait on it") {
  RunningNode node(add_echo);
  const auto echo = connect(node.url("Echo"));
  bool is_refused = false;
  const std::array<Value, 1> text{Value("one")};
  echo.connection().asynchronous().call("Echo", "say", text, [&](const Result<Value>&) {
    try {
      echo.call("say", "two");
    } catch (const std::logic_error&) {
      is_refused = true;
    }
  });
  REQUIRE(echo.connection().run_until([&] { return is_refused; }, 5s));
  CHECK(echo.call("say", "three") == Value("three"));
}

TEST_CASE("an event calls all its handlers, in their order, until they are taken out") {
  RunningNode node(add_echo);
  const auto echo = connect(node.url("Echo"));
  std::string order;
  HandlerRegistration third;
  const auto first = echo.on_event("said", [&](std::span<const Value>) { order += 'a'; });
  HandlerRegistration second;
  second = echo.on_event("said", [&](std::span<const Value>) {
    order += 'b';
    second.remove();
    third.remove();  // was not called yet for this event
  });
  third = echo.on_event("said", [&](std::span<const Value>) { order += 'c'; });
  echo.on_event("said", [&](std::span<const Value>) { order += 'd'; });
  echo.call("say", "one");
  CHECK(order == "abd");
  echo.call("say", "two");
  CHECK(order == "abdad");
  first.remove();
  first.remove();
  HandlerRegistration().remove();
  echo.call("say", "three");
  CHECK(order == "abdadd");
  echo.connection().close();
  third.remove();
}

TEST_CASE("a wait ends in time though handlers that wait take longer than what they are called for") {
  std::shared_ptr<Service> service;
  RunningNode node([&](Node& made) { service = add_echo(made); });
  const auto echo = connect(node.url("Echo"));
  int handled = 0;
  echo.connect_wire("count", [&](const Value&, TimeSpec) {
    std::this_thread::sleep_for(2ms);
    echo.call("say", "x");
    ++handled;
  });
  std::atomic<bool> is_over = false;
  std::thread setter([&] {
    const auto end = std::chrono::steady_clock::now() + 5s;
    for (std::int32_t i = 0; !is_over && std::chrono::steady_clock::now() < end; ++i) {
      node.ask([&](Node&) {
        service->set_wire("count", i);
        return 0;
      });
      std::this_thread::sleep_for(1ms);
    }
  });
  const auto begun = std::chrono::steady_clock::now();
  const auto elapsed = [&] { return std::chrono::steady_clock::now() - begun; };
  echo.connection().run_for(200ms);
  CHECK(elapsed() < 1s);
  echo.connection().run_until([&] { return handled >= 3; }, 3s);
  echo.call("say", "y");
  CHECK(elapsed() < 4s);
  CHECK(handled >= 3);
  is_over = true;
  setter.join();
}

TEST_CASE("a handler of a service may set another one in its place") {
  std::shared_ptr<Service> service;
  std::vector<std::string> said;
  // What a handler holds is there until it returns.
  const auto tell = [&said](const std::weak_ptr<int>& held) { said.emplace_back(held.expired() ? "gone" : "there"); };
  RunningNode node([&](Node& made) {
    service = add_echo(made);
    auto* root = service.get();
    auto one = std::make_shared<int>(1);
    root->function("say", [root, tell, weak = std::weak_ptr(one), one](std::string text) {
      root->function("say", [](std::string) { return "another"; });
      tell(weak);
      return text;
    });
    auto two = std::make_shared<int>(2);
    root->on_wire("count", [root, tell, weak = std::weak_ptr(two), two](std::int32_t) {
      root->on_wire("count", [](std::int32_t) {});
      tell(weak);
    });
    auto three = std::make_shared<int>(3);
    root->pipe("words").on_connect([root, tell, weak = std::weak_ptr(three), three](const PipeEndpoint&) {
      root->pipe("words").on_connect([](const PipeEndpoint&) {});
      tell(weak);
    });
  });
  const auto echo = connect(node.url("Echo"));
  CHECK(echo.call("say", "x") == Value("x"));
  CHECK(echo.call("say", "x") == Value("another"));
  echo.connect_wire("count", [](const Value&, TimeSpec) {});
  echo.send_wire("count", 3);
  const auto words = echo.connect_pipe("words", [](const Value&) {});
  echo.call("say", "x");
  CHECK(node.ask([&](Node&) { return said; }) == std::vector<std::string>(3, "there"));
}

TEST_CASE("a client that ends calls no handlers") {
  std::shared_ptr<Service> service;
  RunningNode node([&](Node& made) { service = add_echo(made); });
  int heard = 0;
  {
    const auto echo = connect(node.url("Echo"));
    echo.on_event("said", [&](std::span<const Value>) { ++heard; });
    echo.call("say", "one");
    CHECK(heard == 1);
    node.ask([&](Node&) { return service->fire("said", "two"), 0; });
    std::this_thread::sleep_for(20ms);  // so that it is there, and not taken
  }
  CHECK(heard == 1);
}

TEST_CASE("a client that waits for no time takes what has come") {
  std::shared_ptr<Service> service;
  RunningNode node([&](Node& made) { service = add_echo(made); });
  const auto echo = connect(node.url("Echo"));
  int heard = 0;
  echo.on_event("said", [&](std::span<const Value>) { ++heard; });
  echo.call("say", "one");
  node.ask([&](Node&) { return service->fire("said", "two"), 0; });
  for (int i = 0; heard < 2 && i < 200; ++i) {
    std::this_thread::sleep_for(10ms);
    echo.connection().run_for(0ms);
  }
  CHECK(heard == 2);
}

TEST_CASE("a wait whose time is over calls one more handler at most") {
  std::shared_ptr<Service> service;
  RunningNode node([&](Node& made) { service = add_echo(made); });
  const auto echo = connect(node.url("Echo"));
  int heard = 0;
  echo.on_event("said", [&](std::span<const Value>) {
    std::this_thread::sleep_for(5ms);
    ++heard;
  });
  node.ask([&](Node&) {
    for (int i = 0; i < 200; ++i) service->fire("said", "x");
    return 0;
  });
  std::this_thread::sleep_for(50ms);
  for (int i = 0; i < 10; ++i) echo.connection().run_for(0ms);
  CHECK(heard <= 50);  // of 200
}

TEST_CASE("a session that ends with its beginning is known as closed") {
  RunningNode node([](Node& made) { add_echo(made)->on_client_connected([&made](ClientId) { made.stop(); }); });
  const auto echo = connect(node.url("Echo"));
  CHECK(echo.connection().run_until([&] { return echo.connection().is_closed(); }, 5s));
  const auto begun = std::chrono::steady_clock::now();
  echo.connection().run_for(1s);
  CHECK(std::chrono::steady_clock::now() - begun < 500ms);
  CHECK(error_of([&] { echo.call("say", "x"); }).code == ErrorCode::connection_error);
}

TEST_CASE("what waits for handlers that take too long is bounded in bytes, too") {
  RunningNode node([](Node& made) { add_echo(made); });
  const auto echo = connect(node.url("Echo"));
  std::string reason;
  echo.connection().asynchronous().on_closed([&](const Error& error) { reason = error.message; });
  bool is_first = true;
  int floods = 0;
  Error failure{ErrorCode::none, {}};
  const auto pipe = echo.connect_pipe("words", [&](const Value&) {
    if (!std::exchange(is_first, false)) return;
    failure = error_of([&] {
      for (; floods < 6; ++floods) echo.call("flood");  // 16 MiB each
    });
  });
  echo.call("provoke");
  echo.connection().run_until([&] { return echo.connection().is_closed(); }, 20s);
  CHECK(floods < 6);
  CHECK(failure.code != ErrorCode::none);
  CHECK_THAT(reason, Contains("bytes: they take too long") && Contains("67108864 bytes"));
}
