#include "node/client/async_object.hpp"

#include <boost/asio/as_tuple.hpp>
#include <boost/asio/bind_cancellation_slot.hpp>
#include <boost/asio/bind_executor.hpp>
#include <boost/asio/co_spawn.hpp>
#include <boost/asio/detached.hpp>
#include <boost/asio/experimental/awaitable_operators.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/use_future.hpp>
#include <catch2/catch.hpp>
#include <mutex>
#include <thread>

#include "test/node/node/node_fixture.hpp"
#include "test/support/print.hpp"

using namespace rr;
namespace asio = boost::asio;

namespace {

constexpr const char* definition = R"(service test.arm
stdver 0.10
object Tool
    property string name [readonly]
end
object Arm
    property double speed
    function double add(double a, double b)
    function void jam()
    event bumped(int32 side)
    objref Tool{string} tools
    wire double torque
    pipe double samples
    function int32{generator} count(int32 from)
    memory uint8[] buffer
    callback double ask(string question)
    function void wonder()
end
)";

void add_arm(Node& node) {
  auto service = Service::from_text({definition}, "Arm", "Arm");
  auto* arm = service.get();
  auto speed = std::make_shared<double>(1);
  service->property("speed").get([speed] { return *speed; }).set([speed](double value) { *speed = value; });
  service->function("add", [arm](double a, double b) {
    arm->fire("bumped", 1);
    return a + b;
  });
  service->function("jam", [] { throw ServiceException("jammed"); });
  service->objref("tools", [arm](std::string_view index) {
    auto tool = arm->make_object("Tool");
    tool->property("name").get([name = std::string(index)] { return name; });
    return tool;
  });
  service->generator("count", [](std::int32_t from) {
    return [next = from, end = from + 2]() mutable -> std::optional<std::int32_t> {
      if (next == end) return std::nullopt;
      return next++;
    };
  });
  auto buffer = std::make_shared<NumberMemory<std::uint8_t>>();
  buffer->dimensions = {4};
  buffer->items = {1, 2, 3, 4};
  service->memory("buffer", buffer);
  service->function("wonder", [arm] {
    arm->call_callback(arm->current_client(), "ask", {Value("how much?")},
                       [arm](const Result<Value>& answer) { arm->set_wire("torque", *answer->to<double>()); });
  });
  service->on_wire("torque", [arm](double value) { arm->set_wire("torque", 2 * value); });
  node.add(service);
}

asio::awaitable<void> use_everything(asio::io_context& io, std::string url, bool& is_done) {
  const auto arm = co_await async_connect(io, url);
  CHECK(arm.path() == "Arm");
  int bumps = 0;
  arm.on_event("bumped", [&](std::span<const Value>) { ++bumps; });
  // No co_await inside of CHECK: it repeats its expression in a condition that is never evaluated, and GCC 12 awaits
  // it.
  const auto sum = co_await arm.call("add", 1.5, 2.25);
  CHECK(*sum.to<double>() == 3.75);
  CHECK(bumps == 1);
  co_await arm.set("speed", 7.0);
  const auto speed = co_await arm.get("speed");
  CHECK(*speed.to<double>() == 7);
  const auto tool = co_await arm.object("tools", "left");
  const auto name = co_await tool.get("name");
  CHECK(name.to_text().value() == "left");

  std::string failure;
  try {
    co_await arm.call("jam");
  } catch (const ClientException& exception) {
    failure = exception.what();
    CHECK(exception.error().code == ErrorCode::operation_failed);
  }
  CHECK(failure == "jammed");
  const auto [error, unused] = co_await arm.get("nothing", asio::as_tuple(asio::use_awaitable));
  CHECK(error != nullptr);

  asio::steady_timer received(io, std::chrono::steady_clock::time_point::max());
  co_await arm.connect_wire("torque", [&](const Value& value, TimeSpec) {
    CHECK(*value.to<double>() == 8);
    received.cancel();
  });
  REQUIRE(arm.send_wire("torque", 4.0));
  co_await received.async_wait(asio::as_tuple(asio::use_awaitable));
  co_await arm.disconnect_wire("torque");

  const auto opened = co_await arm.open_generator("count", std::vector<Value>(1, std::int32_t{5}));
  const auto index = *opened.to<std::int32_t>();
  const auto first = co_await arm.next_generator("count", index);
  CHECK(*first.to<std::int32_t>() == 5);
  co_await arm.close_generator("count", index);

  const auto items = co_await arm.read_memory("buffer", MemoryShape(1, 1), MemoryShape(1, 2));
  CHECK(items == Value(std::vector<std::uint8_t>{2, 3}));
  co_await arm.write_memory("buffer", MemoryShape(1, 3), Value(std::vector<std::uint8_t>(1, 9)));
  const auto last = co_await arm.read_memory("buffer", MemoryShape(1, 3), MemoryShape(1, 1));
  CHECK(last == Value(std::vector<std::uint8_t>(1, 9)));

  arm.on_callback("ask", [](std::span<const Value> question) -> Result<Value> {
    CHECK(question[0].to_text().value() == "how much?");
    return Value(12.5);
  });
  co_await arm.call("wonder");
  for (double told = 0; told != 12.5;) {
    const auto torque = co_await arm.peek_in("torque");
    told = *torque.to<double>();
  }
  arm.connection()->disconnect();
  is_done = true;
}

}  // namespace

TEST_CASE("coroutines use every kind of request") {
  RunningNode node(add_arm);
  asio::io_context io;
  bool is_done = false;
  std::exception_ptr failure;
  asio::co_spawn(io, use_everything(io, node.url("Arm"), is_done), [&](std::exception_ptr e) { failure = e; });
  io.run();  // ends by itself: nothing holds the connection any more
  CHECK(failure == nullptr);
  CHECK(is_done);
}

TEST_CASE("requests of one object overlap") {
  RunningNode node(add_arm);
  asio::io_context io;
  double sum = 0;
  asio::co_spawn(
      io,
      [&]() -> asio::awaitable<void> {
        using namespace asio::experimental::awaitable_operators;
        const auto arm = co_await async_connect(io, node.url("Arm"));
        const auto [three, seven] = co_await (arm.call("add", 1.0, 2.0) && arm.call("add", 3.0, 4.0));
        sum = *three.to<double>() * 100 + *seven.to<double>();
        arm.connection()->disconnect();
      },
      asio::detached);
  io.run();
  CHECK(sum == 307);
}

TEST_CASE("futures and callbacks take results as well, on their own executor") {
  RunningNode node(add_arm);
  asio::io_context io;
  auto work = asio::make_work_guard(io);
  std::thread thread([&] { io.run(); });
  const auto arm = async_connect(io, node.url("Arm"), asio::use_future).get();
  const auto on_io = [&](auto&& start) {
    return asio::dispatch(io, asio::use_future(std::forward<decltype(start)>(start)));
  };

  std::future<Value> sum;
  on_io([&] { sum = arm.call_values("add", std::vector<Value>{1.0, 2.0}, asio::use_future); }).get();
  CHECK(*sum.get().to<double>() == 3);
  std::future<Value> jam;
  on_io([&] { jam = arm.call_values("jam", {}, asio::use_future); }).get();
  CHECK_THROWS_AS(jam.get(), ClientException);

  asio::io_context other;
  std::thread::id called_on;
  on_io([&] {
    arm.get("speed", asio::bind_executor(
                         other, [&](std::exception_ptr, const Value&) { called_on = std::this_thread::get_id(); }));
  }).get();
  other.run();  // has work until the handler was called
  CHECK(called_on == std::this_thread::get_id());

  on_io([&] { arm.connection()->disconnect(); }).get();
  work.reset();
  thread.join();
}

TEST_CASE("requests that wait together in front of a busy service are all answered, however many") {
  constexpr int request_count = 1500;
  RunningNode node(add_arm);
  asio::io_context io;
  std::promise<void> begun, released;
  std::thread busy;
  int answered = 0;
  int refused = 0;
  asio::co_spawn(
      io,
      [&]() -> asio::awaitable<void> {
        const auto arm = co_await async_connect(io, node.url("Arm"));
        busy = std::thread([&] {
          node.ask([&](Node&) {
            begun.set_value();
            released.get_future().wait();
            return 0;
          });
        });
        begun.get_future().wait();
        for (int i = 0; i < request_count; ++i)
          arm.get("speed", [&, connection = arm.connection()](std::exception_ptr failure, const Value&) {
            ++(failure ? refused : answered);
            if (answered + refused == request_count) connection->disconnect();
          });
        released.set_value();
      },
      asio::detached);
  io.run();
  busy.join();
  CHECK(answered == request_count);
  CHECK(refused == 0);
}

TEST_CASE("what was asked for ends when the connection does") {
  asio::io_context io;
  std::exception_ptr failure;
  {
    RunningNode node(add_arm);
    asio::co_spawn(
        io,
        [&]() -> asio::awaitable<void> {
          const auto arm = co_await async_connect(io, node.url("Arm"));
          arm.connection()->close(make_error(ErrorCode::connection_error, "cut"));
          co_await arm.get("speed");
        },
        [&](std::exception_ptr e) { failure = e; });
    io.run();
  }
  CHECK_THROWS_AS(std::rethrow_exception(failure), ClientException);
}

namespace {

/// A service that takes its time, until it is told.
struct SlowArm {
  std::mutex mutex;
  std::vector<Reply<double>> replies;
  int ended = 0;

  void add_to(Node& node) {
    auto service = Service::from_text({definition}, "Arm", "Arm");
    auto* arm = service.get();
    service->property("speed")
        .get([this](Reply<double> reply) { replies.push_back(std::move(reply)); })
        .set([](double) {});
    service->function("add", [](double a, double b) { return a + b; });
    service->function("jam", [this, arm] {
      arm->set_wire("torque", 1.0);
      for (const auto& reply : std::exchange(replies, {})) reply(1.0);
    });
    service->function("wonder", [] {});
    service->objref("tools", [](std::string_view) { return nullptr; });
    service->generator("count", [this](std::int32_t) {
      Generator generator;
      generator.next = [](const Value&) -> Result<std::optional<Value>> { return std::optional<Value>(Value(1)); };
      generator.close = [this] { ++ended; };
      return generator;
    });
    service->pipe("samples").on_close([this](const PipeEndpoint&) { ++ended; });
    node.add(service);
  }
};

AsyncObject connect_arm(asio::io_context& io, const RunningNode& node) {
  AsyncObject arm;
  async_connect(io, node.url("Arm"), [&](const std::exception_ptr&, AsyncObject object) { arm = std::move(object); });
  while (!arm.connection() && io.run_one() != 0) {
  }
  return arm;
}

}  // namespace

TEST_CASE("a request beside a timer ends with the timer, and its answer is dropped when it comes") {
  SlowArm slow;
  RunningNode node([&](Node& made) { slow.add_to(made); });
  asio::io_context io;
  int turns = 0;
  asio::co_spawn(
      io,
      [&]() -> asio::awaitable<void> {
        using namespace asio::experimental::awaitable_operators;
        const auto arm = co_await async_connect(io, node.url("Arm"));
        for (; turns < 3; ++turns) {
          asio::steady_timer timer(io, std::chrono::milliseconds(1));
          const auto first = co_await (arm.get("speed") || timer.async_wait(asio::use_awaitable));
          CHECK(first.index() == 1);
        }
        co_await arm.call("jam");  // the answers
        const auto sum = co_await arm.call("add", 1.0, 2.0);
        CHECK(*sum.to<double>() == 3);
        arm.connection()->disconnect();
      },
      [](std::exception_ptr failure) { CHECK(failure == nullptr); });
  io.run_for(std::chrono::seconds(5));  // a request waits 15 s
  CHECK(turns == 3);
  CHECK(io.stopped());
}

TEST_CASE("a request that is cancelled fails so; cancelling what has ended does nothing") {
  SlowArm slow;
  RunningNode node([&](Node& made) { slow.add_to(made); });
  asio::io_context io;
  asio::cancellation_signal signal;
  std::vector<ErrorCode> codes;
  const auto arm = connect_arm(io, node);
  const auto note = [&](const std::exception_ptr& failure, const Value&) {
    codes.push_back(failure ? error_of([&] { std::rethrow_exception(failure); }).code : ErrorCode::none);
  };
  arm.get("speed", asio::bind_cancellation_slot(signal.slot(), note));
  signal.emit(asio::cancellation_type::total);  // promises that nothing has happened, which nobody can
  io.poll();
  CHECK(codes.empty());
  signal.emit(asio::cancellation_type::terminal);
  CHECK(codes.empty());  // not from within
  while (codes.empty() && io.run_one() != 0) {
  }
  CHECK(codes == std::vector{ErrorCode::operation_cancelled});
  signal.emit(asio::cancellation_type::terminal);
  arm.call_values("add", {1.0, 2.0}, asio::bind_cancellation_slot(signal.slot(), note));
  while (codes.size() < 2 && io.run_one() != 0) {
  }
  signal.emit(asio::cancellation_type::terminal);
  io.poll();
  CHECK(codes == std::vector{ErrorCode::operation_cancelled, ErrorCode::none});
  arm.connection()->disconnect();
  io.run();
}

TEST_CASE("what a cancelled request began with the service is ended") {
  SlowArm slow;
  RunningNode node([&](Node& made) { slow.add_to(made); });
  asio::io_context io;
  const auto arm = connect_arm(io, node);
  asio::cancellation_signal wire, pipe, generator;
  int cancelled = 0;
  int received = 0;
  const auto note = [&](const std::exception_ptr& failure, const Value&) { cancelled += failure != nullptr; };
  ClientConnection::PipeHandlers handlers;
  handlers.received = [&](const Value&) { ++received; };
  arm.connect_wire(
      "torque", [&](const Value&, TimeSpec) { ++received; }, asio::bind_cancellation_slot(wire.slot(), note));
  arm.connect_pipe("samples", handlers, any_pipe_index, asio::bind_cancellation_slot(pipe.slot(), note));
  arm.open_generator("count", {Value(1)}, asio::bind_cancellation_slot(generator.slot(), note));
  for (auto* signal : {&wire, &pipe, &generator}) signal->emit(asio::cancellation_type::terminal);
  io.poll();
  CHECK(cancelled == 3);
  const auto ended = [&] { return node.ask([&](Node&) { return slow.ended; }); };
  const auto jam = [&] {
    bool is_done = false;
    arm.call_values("jam", {}, [&](const std::exception_ptr&, const Value&) { is_done = true; });
    while (!is_done && io.run_one() != 0) {
    }
  };
  for (int turn = 0; turn < 100 && ended() != 2; ++turn) jam();
  CHECK(ended() == 2);
  jam();  // sets the wire
  CHECK(received == 0);
  CHECK(error_of([&] {
          if (const auto sent = arm.send_wire("torque", 1.0); !sent) throw ClientException(sent.error());
        }).code != ErrorCode::none);
  arm.connection()->disconnect();
  io.run();
}

TEST_CASE("connecting can be cancelled") {
  asio::io_context io;
  asio::ip::tcp::acceptor silent(io, {asio::ip::make_address("127.0.0.1"), 0});
  const auto url = "rr+tcp://127.0.0.1:" + std::to_string(silent.local_endpoint().port()) + "/?service=Arm";
  asio::cancellation_signal signal;
  auto code = ErrorCode::none;
  async_connect(io, url,
                asio::bind_cancellation_slot(signal.slot(), [&](const std::exception_ptr& failure, AsyncObject) {
                  code = error_of([&] { std::rethrow_exception(failure); }).code;
                }));
  while (io.poll() != 0) {
  }
  signal.emit(asio::cancellation_type::terminal);
  io.run_for(std::chrono::seconds(5));
  CHECK(code == ErrorCode::operation_cancelled);
  CHECK(io.stopped());
}

TEST_CASE("a wire that is connected again stays so when the answer to a cancelled connect comes") {
  SlowArm slow;
  RunningNode node([&](Node& made) { slow.add_to(made); });
  asio::io_context io;
  const auto arm = connect_arm(io, node);
  asio::cancellation_signal first;
  bool is_cancelled = false;
  int received_by_first = 0;
  int received_by_second = 0;
  arm.connect_wire(
      "torque", [&](const Value&, TimeSpec) { ++received_by_first; },
      asio::bind_cancellation_slot(first.slot(), [&](const std::exception_ptr& failure, const Value&) {
        is_cancelled = error_of([&] { std::rethrow_exception(failure); }).code == ErrorCode::operation_cancelled;
      }));
  first.emit(asio::cancellation_type::terminal);
  bool is_connected = false;
  arm.connect_wire(
      "torque", [&](const Value&, TimeSpec) { ++received_by_second; },
      [&](const std::exception_ptr& failure, const Value&) { is_connected = failure == nullptr; });
  while (!(is_cancelled && is_connected) && io.run_one() != 0) {
  }
  for (int turn = 0; turn < 100 && received_by_second == 0; ++turn) {
    bool is_done = false;
    arm.call_values("jam", {}, [&](const std::exception_ptr&, const Value&) { is_done = true; });  // sets the wire
    while (!is_done && io.run_one() != 0) {
    }
  }
  CHECK(received_by_first == 0);
  CHECK(received_by_second > 0);
  CHECK(arm.send_wire("torque", 1.0));
  arm.connection()->disconnect();
  io.run();
}

TEST_CASE("a connection keeps no handler of what failed, and none that is given to it after its end") {
  RunningNode node(add_arm);
  asio::io_context io;
  std::shared_ptr<ClientConnection> connection;
  ClientConnection::open(io, node.url("Arm"), {},
                         [&](Result<std::shared_ptr<ClientConnection>> opened) { connection = std::move(*opened); });
  while (!connection && io.run_one() != 0) {
  }
  const auto watch = std::make_shared<int>();
  int failures = 0;
  const auto connect = [&](const std::string& wire) {
    connection->on_wire_closed("Arm", wire, [watch] {});
    connection->connect_wire(
        "Arm", wire, [watch](const Value&, TimeSpec) {},
        [&](const Result<Value>& result) { failures += result ? 0 : 1; });
  };
  connect("nothing");
  CHECK(failures == 1);
  CHECK(watch.use_count() == 1);
  connection->disconnect();
  io.run();
  io.restart();
  REQUIRE(connection->is_closed());
  connect("torque");
  CHECK(failures == 2);
  connection->on_event("Arm", "bumped", [watch](std::span<const Value>) {});
  connection->on_callback("Arm", "ask", [watch](std::span<const Value>) { return Result<Value>(Value(1.0)); });
  connection->on_path_released([watch](const std::string&) {});
  CHECK(watch.use_count() == 1);
  int ends = 0;
  connection->on_closed([&, keep = connection](const Error&) { ++ends; });
  CHECK(ends == 0);  // not from within
  const std::weak_ptr<ClientConnection> weak = std::exchange(connection, nullptr);
  io.run();
  CHECK(ends == 1);
  CHECK(weak.expired());
}
