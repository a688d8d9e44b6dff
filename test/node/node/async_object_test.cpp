#include "node/client/async_object.hpp"

#include <boost/asio/as_tuple.hpp>
#include <boost/asio/bind_executor.hpp>
#include <boost/asio/co_spawn.hpp>
#include <boost/asio/detached.hpp>
#include <boost/asio/experimental/awaitable_operators.hpp>
#include <boost/asio/use_future.hpp>
#include <catch2/catch.hpp>
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
