// Many clients that use every kind of member at once, and clients that come and go. RRGATE_HAMMER_SECONDS (2) and
// RRGATE_HAMMER_CYCLES (10000) say how long; `./dev asan` and `./dev tsan` hammer for a minute.
#include <atomic>
#include <boost/asio/as_tuple.hpp>
#include <boost/asio/co_spawn.hpp>
#include <catch2/catch.hpp>
#include <cstdlib>
#include <fstream>
#include <list>
#include <map>
#include <thread>

#include "node/client/async_object.hpp"
#include "test/node/node/node_fixture.hpp"

using namespace rr;
using namespace std::chrono_literals;
namespace asio = boost::asio;
using asio::awaitable;

namespace {

constexpr int client_count = 64;
constexpr int thread_count = 4;
constexpr std::uint64_t pipe_window = 32;   // packets under way
constexpr std::uint64_t memory_share = 64;  // bytes of each client

constexpr const char* definition = R"(service test.anvil
stdver 0.10
object Tool
    property string name [readonly]
end
object Anvil
    property double speed
    function double add(double a, double b)
    function int32{generator} count(int32 from)
    event struck(uint64 number)
    objref Tool{string} tools
    pipe uint64 packets
    function void wonder(uint64 number)
    callback uint64 ask(uint64 number)
    wire uint64 clock
    memory uint8[] buffer
end
)";

int setting(const char* name, int otherwise) {
  const char* text = std::getenv(name);
  return text ? std::atoi(text) : otherwise;
}

/// The node's side: what it counts is read when the node has stopped.
struct Anvil {
  std::shared_ptr<Service> service;
  std::uint64_t ticks = 0;
  std::uint64_t callback_answers = 0;
  std::uint64_t callback_failures = 0;
  double speed = 0;

  void add_to(Node& node) {
    service = Service::from_text({definition}, "Anvil", "Anvil");
    service->property("speed").get([this] { return speed; }).set([this](double value) { speed = value; });
    service->function("add", [](double a, double b) { return a + b; });
    service->generator("count", [](std::int32_t from) {
      return [next = from, end = from + 3]() mutable -> std::optional<std::int32_t> {
        if (next == end) return std::nullopt;
        return next++;
      };
    });
    service->objref("tools", [this](std::string_view index) {
      auto& tool = tools[std::string(index)];
      if (!tool) {
        tool = service->make_object("Tool");
        tool->property("name").get([name = std::string(index)] { return name; });
      }
      return tool;
    });
    service->pipe("packets").on_packet([this](const PipeEndpoint& from, const Value& packet) {
      if (!from.send(packet)) ++callback_failures;
    });
    service->function("wonder", [this](std::uint64_t number) {
      service->call_callback(service->current_client(), "ask", {Value(number)},
                             [this, number](const Result<Value>& answer) {
                               const bool is_right = answer && answer->to<std::uint64_t>().value() == number + 1;
                               ++(is_right ? callback_answers : callback_failures);
                             });
    });
    auto buffer = std::make_shared<NumberMemory<std::uint8_t>>();
    buffer->dimensions = {client_count * memory_share};
    buffer->items.assign(client_count * memory_share, 0);
    service->memory("buffer", buffer);
    service->set_wire("clock", Value(ticks));
    service->root().allow_monitor();
    node.add(service);
    node.every(5ms, [this] {
      service->fire("struck", ++ticks);
      service->set_wire("clock", Value(ticks));
    });
  }

 private:
  std::map<std::string, std::shared_ptr<Object>> tools;
};

/// One client; its loops run on one thread.
class Hammer {
 public:
  /// Hammers for `duration` once `ready` clients are `client_count`.
  Hammer(asio::io_context& io, std::string url, int number, std::chrono::seconds duration, std::atomic<int>& ready)
      : io_(io),
        url_(std::move(url)),
        number_(number),
        duration_(duration),
        ready_(ready),
        packet_arrived_(io),
        loop_ended_(io) {}

  void start() {
    asio::co_spawn(io_, run(), [this](std::exception_ptr what) {
      note(what);
      if (anvil_.connection()) anvil_.connection()->disconnect();  // or it would hold the thread
    });
  }

  std::uint64_t answers = 0;
  std::uint64_t wrong = 0;
  std::uint64_t wonders = 0;
  std::uint64_t packets_sent = 0;
  std::uint64_t packets_received = 0;
  std::uint64_t events = 0;
  bool is_finished = false;
  std::string failure;

 private:
  bool is_over() const { return std::chrono::steady_clock::now() >= end_ || !failure.empty(); }
  void note(std::exception_ptr what) {
    if (!what) return;
    try {
      std::rethrow_exception(what);
    } catch (const std::exception& exception) {
      failure = exception.what();
    }
    ready_ = client_count;  // nobody waits for one who won't come
    packet_arrived_.cancel();
    loop_ended_.cancel();
  }
  void expect(bool is_right) {
    ++answers;
    if (!is_right) ++wrong;
  }
  /// Until the signal is cancelled, which tells that something happened. One waiter a signal.
  awaitable<void> wait_for(asio::steady_timer& signal, std::chrono::seconds patience) {
    signal.expires_after(patience);
    auto [error] = co_await signal.async_wait(asio::as_tuple(asio::use_awaitable));
    if (!error) throw std::runtime_error("nothing happened for " + std::to_string(patience.count()) + " s");
  }
  /// Those who come late would find a node that is too busy to answer them in time.
  awaitable<void> wait_for_all() {
    asio::steady_timer pause(io_);
    for (++ready_; ready_ < client_count;) {
      pause.expires_after(10ms);
      co_await pause.async_wait(asio::use_awaitable);
    }
    end_ = std::chrono::steady_clock::now() + duration_;
  }
  void spawn(awaitable<void> loop) {
    ++loops_;
    asio::co_spawn(io_, std::move(loop), [this](std::exception_ptr what) {
      --loops_;
      note(what);
      loop_ended_.cancel();
    });
  }

  awaitable<void> run() {
    anvil_ = co_await async_connect(io_, url_);
    co_await wait_for_all();
    anvil_.on_event("struck", [this](std::span<const Value> arguments) {
      const auto number = arguments[0].to<std::uint64_t>().value();
      if (last_event_ != 0 && number != last_event_ + 1) ++wrong;
      last_event_ = number;
      ++events;
    });
    anvil_.on_callback("ask", [](std::span<const Value> arguments) -> Result<Value> {
      return Value(arguments[0].to<std::uint64_t>().value() + 1);
    });
    co_await anvil_.connect_wire("clock", [this](const Value& value, TimeSpec) {
      const auto number = value.to<std::uint64_t>().value();
      if (number < last_tick_) ++wrong;
      last_tick_ = number;
    });
    ClientConnection::PipeHandlers handlers;
    handlers.received = [this](const Value& packet) {
      if (packet.to<std::uint64_t>().value() != packets_received++) ++wrong;
      packet_arrived_.cancel();
    };
    const auto opened = co_await anvil_.connect_pipe("packets", std::move(handlers));
    pipe_ = opened.to<std::int32_t>().value();
    for (auto loop : {&Hammer::properties, &Hammer::functions, &Hammer::generators, &Hammer::objects, &Hammer::packets,
                      &Hammer::callbacks, &Hammer::memories})
      spawn((this->*loop)());
    while (loops_ > 0) co_await wait_for(loop_ended_, 600s);
    while (packets_received < packets_sent && failure.empty()) co_await wait_for(packet_arrived_, 20s);
    is_finished = true;
  }

  awaitable<void> properties() {
    while (!is_over()) {
      co_await anvil_.set("speed", static_cast<double>(number_));
      const auto speed = co_await anvil_.get("speed");
      expect(speed.to<double>().value() < client_count);
    }
  }
  awaitable<void> functions() {
    for (double i = 0; !is_over(); ++i) {
      const auto sum = co_await anvil_.call("add", i, 1.0);
      expect(sum.to<double>().value() == i + 1);
    }
  }
  awaitable<void> generators() {
    for (std::int32_t i = 0; !is_over(); ++i) {
      const auto opened = co_await anvil_.open_generator("count", std::vector<Value>(1, i));
      const auto index = opened.to<std::int32_t>().value();
      for (std::int32_t j = 0; j < 2; ++j) {
        const auto value = co_await anvil_.next_generator("count", index);
        expect(value.to<std::int32_t>().value() == i + j);
      }
      co_await anvil_.close_generator("count", index);
    }
  }
  awaitable<void> objects() {
    for (int i = 0; !is_over(); ++i) {
      const std::string index = std::to_string(i % 16);
      const auto tool = co_await anvil_.object("tools", index);
      const auto name = co_await tool.get("name");
      expect(name.to_text().value() == index);
    }
  }
  awaitable<void> packets() {
    while (!is_over()) {
      while (packets_sent - packets_received >= pipe_window && failure.empty()) co_await wait_for(packet_arrived_, 20s);
      if (const auto sent = anvil_.send_pipe("packets", pipe_, Value(packets_sent)); !sent)
        throw std::runtime_error(sent.error().message);
      ++packets_sent;
    }
  }
  awaitable<void> callbacks() {
    while (!is_over()) {
      co_await anvil_.call("wonder", wonders);
      ++wonders;
    }
  }
  awaitable<void> memories() {
    const MemoryShape position(1, memory_share * static_cast<std::uint64_t>(number_));
    const MemoryShape count(1, memory_share);
    for (std::uint8_t i = 0; !is_over(); ++i) {
      const Value block(std::vector<std::uint8_t>(memory_share, i));
      co_await anvil_.write_memory("buffer", position, block);
      const auto items = co_await anvil_.read_memory("buffer", position, count);
      expect(items == block);
    }
  }

  asio::io_context& io_;
  std::string url_;
  int number_;
  std::chrono::seconds duration_;
  std::atomic<int>& ready_;
  std::chrono::steady_clock::time_point end_;
  asio::steady_timer packet_arrived_;
  asio::steady_timer loop_ended_;
  AsyncObject anvil_;
  std::int32_t pipe_ = 0;
  std::uint64_t last_event_ = 0;
  std::uint64_t last_tick_ = 0;
  int loops_ = 0;
};

/// Bytes that are in memory and ours.
std::size_t resident_bytes() {
  std::ifstream statm("/proc/self/statm");
  std::size_t size = 0;
  std::size_t resident = 0;
  statm >> size >> resident;
  return resident * 4096;
}

}  // namespace

TEST_CASE("64 clients hammer every kind of member: nothing is lost, everything is answered") {
  Anvil anvil;
  std::list<asio::io_context> contexts(thread_count);  // outlive the clients
  std::atomic<int> ready{0};
  std::list<Hammer> hammers;
  {
    RunningNode node([&](Node& into) { anvil.add_to(into); });
    const std::chrono::seconds duration(setting("RRGATE_HAMMER_SECONDS", 2));
    auto io = contexts.begin();
    for (int i = 0; i < client_count; ++i) {
      hammers.emplace_back(*io, node.url("Anvil"), i, duration, ready).start();
      if (++io == contexts.end()) io = contexts.begin();
    }
    std::vector<std::thread> threads;
    for (auto& context : contexts) threads.emplace_back([&context] { context.run(); });
    for (auto& thread : threads) thread.join();
    for (int i = 0; i < 500 && node.ask([](Node& of) { return of.client_count(); }) > 0; ++i)
      std::this_thread::sleep_for(10ms);
    CHECK(node.ask([](Node& of) { return of.client_count(); }) == 0);
  }
  std::uint64_t answers = 0;
  std::uint64_t packets = 0;
  std::uint64_t wonders = 0;
  for (const auto& hammer : hammers) {
    CHECK(hammer.failure == "");
    CHECK(hammer.is_finished);
    CHECK(hammer.wrong == 0);
    CHECK(hammer.packets_received == hammer.packets_sent);
    CHECK(hammer.packets_sent > 0);
    CHECK(hammer.events > 0);
    CHECK(hammer.answers > 0);
    answers += hammer.answers;
    packets += hammer.packets_sent;
    wonders += hammer.wonders;
  }
  // An answer may be under way when its client goes.
  CHECK(anvil.callback_answers + anvil.callback_failures == wonders);
  CHECK(anvil.callback_answers > 0);
  CHECK(anvil.callback_failures <= client_count);
  std::printf("hammer: %llu checked answers, %llu packets there and back, %llu callbacks\n",
              static_cast<unsigned long long>(answers), static_cast<unsigned long long>(packets),
              static_cast<unsigned long long>(wonders));
}

TEST_CASE("clients that come and go leave nothing behind") {
  Anvil anvil;
  RunningNode node([&](Node& into) { anvil.add_to(into); });
  const auto come_and_go = [&](int i) {
    asio::io_context io;
    std::exception_ptr failure;
    bool is_closed = false;
    asio::co_spawn(
        io,
        [&]() -> awaitable<void> {
          const auto object = co_await async_connect(io, node.url("Anvil"));
          object.connection()->on_closed([&](const Error&) { is_closed = true; });
          // Named, because GCC 12 destroys twice what is made within a co_await expression.
          ClientConnection::WireHandler received = [](const Value&, TimeSpec) {};
          co_await object.connect_wire("clock", std::move(received));
          ClientConnection::PipeHandlers handlers;
          co_await object.connect_pipe("packets", std::move(handlers));
          co_await object.open_generator("count", std::vector<Value>(1, std::int32_t{1}));
          co_await object.enter_monitor(5s);
          // Every other one vanishes without a word, its monitor lock and generator still there.
          if (i % 2 == 0)
            object.connection()->disconnect();
          else
            object.connection()->close(make_error(ErrorCode::connection_error, "cut"));
        },
        [&](std::exception_ptr what) { failure = what; });
    while (!is_closed && !failure) io.run_one();
    if (failure) std::rethrow_exception(failure);
  };
  const int cycles = setting("RRGATE_HAMMER_CYCLES", 10000);
  for (int i = 0; i < cycles / 3; ++i) come_and_go(i);  // pools and caches fill
  const auto before = resident_bytes();
  for (int i = cycles / 3; i < cycles; ++i) come_and_go(i);
  for (int i = 0; i < 500 && node.ask([](Node& of) { return of.client_count(); }) > 0; ++i)
    std::this_thread::sleep_for(10ms);
  CHECK(node.ask([](Node& of) { return of.client_count(); }) == 0);
  CHECK(anvil.service->pipe("packets").endpoints().empty());
  const auto after = resident_bytes();
  std::printf("cycles: %d, %zu kB resident after a third, %zu kB at the end\n", cycles, before / 1024, after / 1024);
  // What is left of a cycle for five minutes is the number of its endpoint, which nobody else may have so long.
  const std::size_t resting = static_cast<std::size_t>(cycles - cycles / 3) * 64;
#ifdef __SANITIZE_THREAD__
  const std::size_t of_sanitizer = 4 * 1024 * 1024;  // what ThreadSanitizer remembers of each access
#else
  const std::size_t of_sanitizer = 0;
#endif
  CHECK(after < before + resting + of_sanitizer + 1024 * 1024);
}
