#include "node/client/client.hpp"

#include <boost/asio/ip/tcp.hpp>
#include <catch2/catch.hpp>

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
    event said(string text)
    wire int32 count
end
)";

void add_echo(Node& node) {
  auto service = Service::from_text({definition}, "Echo", "Echo");
  service->function("say", [service = service.get()](std::string text) {
    service->fire("said", text);
    return text;
  });
  service->set_wire("count", 5);
  node.add(service);
}

}  // namespace

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

TEST_CASE("handlers may use the connection, but not wait on it") {
  RunningNode node(add_echo);
  const auto echo = connect(node.url("Echo"));
  std::vector<std::string> said;
  bool is_refused = false;
  echo.on_event("said", [&](std::span<const Value> arguments) {
    said.emplace_back(*arguments.front().to_text());
    if (said.size() > 1) return;
    const std::array<Value, 1> more{Value("two")};
    echo.connection().asynchronous().call("Echo", "say", more, nullptr);
    try {
      echo.call("say", "three");
    } catch (const std::logic_error&) {
      is_refused = true;
    }
  });
  echo.call("say", "one");
  REQUIRE(echo.connection().run_until([&] { return said.size() == 2; }, 5s));
  CHECK(said == std::vector<std::string>{"one", "two"});
  CHECK(is_refused);
}
