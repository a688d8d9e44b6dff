// Callbacks of clients, called by services over real sockets.
#include <boost/asio/io_context.hpp>
#include <catch2/catch.hpp>

#include "test/node/node/node_fixture.hpp"
#include "test/support/print.hpp"

using namespace rr;
using namespace std::chrono_literals;
using Catch::Matchers::Contains;
using Catch::Matchers::Equals;

namespace {

constexpr const char* definition = R"(service test.bell
stdver 0.10

object Clapper
    callback double ask(string question)
    function void settle()
end

object Bell
    objref Clapper left
    objref Clapper right
    callback double ask(string question)
    callback void notice()
    function void ring()
    function void settle()
end
)";

struct Bell {
  std::shared_ptr<Service> service = Service::from_text({definition}, "bell", "Bell");
  std::shared_ptr<Object> clapper = service->make_object("Clapper");  ///< one object, known by two paths
  ClientId client = 0;
  std::vector<Result<Value>> answers;
  std::vector<std::string> reports;
  RunningNode node{[this](Node& made) { prepare(made); }, options()};

  NodeOptions options() {
    NodeOptions made;
    made.report = [this](const std::string& problem) { reports.push_back(problem); };
    return made;
  }
  void prepare(Node& made) {
    service->on_client_connected([this](ClientId id) { client = id; });
    service->function("ring", [this] { ask(service->current_client()); });
    service->function("settle", [] {});
    for (const char* side : {"left", "right"}) service->objref(side, [this] { return clapper; });
    clapper->function("settle", [] {});
    made.add(service);
  }

  void ask(ClientId whom) {
    service->call_callback(whom, "ask", {"who is there?"},
                           [this](Result<Value> answer) { answers.push_back(std::move(answer)); });
  }
  std::vector<Result<Value>> answers_now() {
    return node.ask([this](Node&) { return answers; });
  }
  /// The answer to one ring of `remote`.
  Result<Value> ring(const RemoteObject& remote) {
    remote.call("ring");
    remote.call("settle");  // behind the answer
    return answers_now().back();
  }
};

}  // namespace

TEST_CASE("a client answers with a value, with an error, by throwing, and where nothing is set") {
  Bell bell;
  const auto client = rr::connect(bell.node.url("bell"));
  CHECK(bell.ring(client).error().code == ErrorCode::invalid_operation);
  CHECK(bell.ring(client).error().message == "Callback function not set");
  std::string asked;
  client.on_callback("ask", [&](const std::string& question) {
    asked = question;
    return 2.5;
  });
  CHECK(bell.ring(client).value() == Value(2.5));
  CHECK(asked == "who is there?");
  client.on_callback_values(
      "ask", [](std::span<const Value>) -> Result<Value> { return make_error(ErrorCode::operation_failed, "nobody"); });
  CHECK(bell.ring(client).error().message == "nobody");
  client.on_callback("ask", [](const std::string&) -> double { throw std::runtime_error("asleep"); });
  const auto thrown = bell.ring(client).error();
  CHECK(thrown.qualified_name() == "rrgate.UnhandledException");
  CHECK(thrown.message == "asleep");
}

TEST_CASE("an object with several paths is called by one that the client uses") {
  Bell bell;
  const auto first = rr::connect(bell.node.url("bell"));
  const auto left = first.object("left");
  const auto second = rr::connect(bell.node.url("bell"));
  const auto right = second.object("right");
  right.on_callback("ask", [](const std::string&) { return 1.5; });
  const auto ask = [&] {
    bell.node.ask([&](Node&) {
      bell.clapper->call_callback(bell.client, "ask", {"who is there?"},
                                  [&](Result<Value> answer) { bell.answers.push_back(std::move(answer)); });
      return 0;
    });
  };
  ask();
  right.call("settle");
  right.call("settle");
  REQUIRE(bell.answers_now().size() == 1);
  CHECK(bell.answers_now().back().value() == Value(1.5));
  const auto third = rr::connect(bell.node.url("bell"));  // uses no path of it
  third.call("settle");
  ask();
  third.call("settle");
  REQUIRE(bell.answers_now().size() == 2);
  CHECK(bell.answers_now().back().error().code == ErrorCode::object_not_found);
}

TEST_CASE("calls to clients that are gone, or go, end with an error") {
  Bell bell;
  {
    const auto client = rr::connect(bell.node.url("bell"));
    // The client does not run, and answers nothing.
    bell.node.ask([&](Node&) { return bell.ask(bell.client), 0; });
    client.connection().asynchronous().close(make_error(ErrorCode::connection_error, "gone"));
  }
  const auto deadline = std::chrono::steady_clock::now() + 5s;
  while (bell.answers_now().empty() && std::chrono::steady_clock::now() < deadline) std::this_thread::yield();
  REQUIRE(bell.answers_now().size() == 1);
  CHECK(bell.answers_now().front().error().code == ErrorCode::connection_error);

  bell.node.ask([&](Node&) {
    bell.ask(bell.client);
    CHECK(bell.answers.size() == 1);  // not within the call
    return 0;
  });
  bell.node.ask([](Node&) { return 0; });
  CHECK(bell.answers_now().back().error().message == "callback 'ask': the client is not connected");
}

TEST_CASE("who hears the end of a callback may throw, or be nobody, wherever the client is") {
  Bell bell;
  const auto client = rr::connect(bell.node.url("bell"));
  const auto call = [&](Object& object, ClientId whom) {
    object.call_callback(whom, "ask", {"who is there?"},
                         [](const Result<Value>&) { throw std::runtime_error("unheard"); });
    object.call_callback(whom, "ask", {"who is there?"}, nullptr);
  };
  bell.node.ask([&](Node&) {
    call(bell.service->root(), bell.client);
    call(bell.service->root(), bell.client + 1);  // is not there
    call(*bell.clapper, bell.client);             // does not use it
    return 0;
  });
  client.call("settle");
  client.call("settle");  // behind the answers
  const auto unheard = "callback 'ask': its handler failed: unheard";
  CHECK(bell.node.ask([&](Node&) { return bell.reports; }) == std::vector<std::string>{unheard, unheard, unheard});
}

TEST_CASE("a node that has gone calls nobody who waits for a callback") {
  boost::asio::io_context io;
  const auto service = Service::from_text({definition}, "bell", "Bell");
  service->serve_partly("it is a test");
  auto node = std::make_unique<Node>(io, "test.node");
  node->add(service);
  bool is_ended = false;
  service->call_callback(1, "ask", {"who is there?"}, [&](const Result<Value>&) { is_ended = true; });
  node.reset();
  io.run();
  CHECK_FALSE(is_ended);
}

TEST_CASE("callbacks and arguments that are not there are refused where they are called") {
  const auto service = Service::from_text({definition}, "bell", "Bell");
  const auto refusal = [&](std::string_view callback, const std::vector<Value>& arguments) {
    try {
      service->call_callback(1, callback, arguments, nullptr);
    } catch (const std::invalid_argument& refused) {
      return std::string(refused.what());
    }
    return std::string("not refused");
  };
  CHECK_THAT(refusal("ring", {}), Equals("test.bell.Bell.ring is a function, not a callback"));
  CHECK_THAT(refusal("ask", {}), Equals("test.bell.Bell.ask: called with 0 arguments, the definition has 1"));
  CHECK_THAT(refusal("ask", {5}), Contains("argument 'question'"));
  CHECK_THAT(refusal("notice", {}), Contains("in no node"));
}
