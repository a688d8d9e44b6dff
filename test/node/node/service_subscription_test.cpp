// Subscriptions by URL: connections that come back, wires and pipes that go on, and an end that leaves nothing behind.
#include "node/subscribe/service_subscription.hpp"

#include <array>
#include <boost/asio/co_spawn.hpp>
#include <boost/asio/detached.hpp>
#include <boost/asio/experimental/awaitable_operators.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/use_future.hpp>
#include <catch2/catch.hpp>
#include <numeric>

#include "node/driver/backoff.hpp"
#include "test/node/node/node_fixture.hpp"
#include "test/support/print.hpp"

using namespace rr;
using namespace std::chrono_literals;
namespace asio = boost::asio;
using Catch::Matchers::Contains;

namespace {

constexpr const char* definition = R"(service test.lamp
stdver 0.10
object Bulb
    wire int32 heat
end
object Lamp
    property int32 level
    function int32 wait()
    wire int32 light
    pipe int32 flashes
    objref Bulb bulb
end
)";

/// A node that can be stopped and started again on its port. Each life has a number, which its wires and pipes tell.
class LampNode {
 public:
  explicit LampNode(std::uint16_t port = 0) : port_(port) { start(); }

  void start() {
    ++life_;
    node_ = std::make_unique<Node>("test.lamp");
    service_ = Service::from_text({definition}, "Lamp", "Lamp");
    service_->property("level").get([life = life_] { return life; }).set([](std::int32_t) {});
    service_->function("wait", [this] {
      node_->post([this] { node_->stop(); });
      std::this_thread::sleep_for(20ms);
      return 1;
    });
    service_->on_wire("light", [this](std::int32_t value) { service_->set_wire("light", value); });
    service_->pipe("flashes").on_packet([](const PipeEndpoint& endpoint, std::int32_t value) {
      for (std::int32_t i = 0; i < 3; ++i) (void)endpoint.send(value + i);
    });
    service_->objref("bulb", [this] {
      auto bulb = service_->make_object("Bulb");
      bulb->on_wire("heat", [](std::int32_t) {});
      bulb->set_wire("heat", 100 + life_);
      return bulb;
    });
    node_->add(service_);
    port_ = node_->listen("rr+tcp://127.0.0.1:" + std::to_string(port_));
    thread_ = std::thread([this] { node_->run(); });
  }
  void stop() {
    if (!thread_.joinable()) return;
    node_->post([this] { node_->stop(); });
    thread_.join();
    service_.reset();
    node_.reset();
  }
  ~LampNode() { stop(); }

  std::string url() const { return "rr+tcp://127.0.0.1:" + std::to_string(port_) + "/?service=Lamp"; }
  std::int32_t life() const { return life_; }

 private:
  std::uint16_t port_;
  std::int32_t life_ = 0;
  std::unique_ptr<Node> node_;
  std::shared_ptr<Service> service_;
  std::thread thread_;
};

SubscriptionOptions quick() {
  SubscriptionOptions options;
  options.first_retry = 20ms;
  options.longest_retry = 100ms;
  options.member_retry = 30ms;
  return options;
}

/// Runs a coroutine, and then the io_context until it has nothing left to do: within a second of the end.
template <class F>
void run(asio::io_context& io, F work) {
  std::exception_ptr failure;
  bool is_done = false;
  asio::co_spawn(io, std::move(work), [&](std::exception_ptr e) {
    failure = e;
    is_done = true;
  });
  const auto limit = std::chrono::steady_clock::now() + 20s;
  while (!is_done && std::chrono::steady_clock::now() < limit) io.run_one_for(1s);
  REQUIRE(is_done);
  if (failure) std::rethrow_exception(failure);
  const auto ended = std::chrono::steady_clock::now();
  io.run_for(5s);
  CHECK(io.stopped());  // it was out of work
  CHECK(std::chrono::steady_clock::now() - ended < 1500ms);
}

std::int32_t number(const Value& value) {
  return value.to<std::int32_t>().value();
}

}  // namespace

TEST_CASE("backoff: twice as long each time, half of it by chance, from the beginning after a success") {
  Backoff backoff(500ms, 30s);
  for (const auto step : {500ms, 1000ms, 2000ms, 4000ms, 8000ms, 16000ms, 30000ms, 30000ms}) {
    const auto wait = backoff.next();
    CHECK(wait >= step / 2);
    CHECK(wait <= step);
  }
  backoff.reset();
  CHECK(backoff.next() <= 500ms);
}

TEST_CASE("a subscription connects again after each loss, and its wires and pipes go on") {
  LampNode lamp;
  asio::io_context io;
  int connected = 0;
  int lost = 0;
  run(io, [&]() -> asio::awaitable<void> {
    auto lamps = subscribe_service(io, lamp.url(), quick());
    auto light = lamps.wire("light");
    auto flashes = lamps.pipe("flashes");
    MemberSubscriptionOptions in_bulb;
    in_bulb.path = "*.bulb";
    auto heat = lamps.wire("heat", in_bulb);
    lamps.on_connected([&](const AsyncObject&) { ++connected; });
    lamps.on_lost([&](const AsyncObject& client, const Error& reason) {
      ++lost;
      CHECK(client.path() == "Lamp");
      CHECK(reason.code != ErrorCode::none);
    });
    for (std::int32_t life = 1; life <= 3; ++life) {
      const auto client = co_await lamps.client(5s);
      const auto level = co_await client.get("level");
      CHECK(number(level) == life);
      while (light.connected_count() == 0 || flashes.connected_count() == 0) co_await client.get("level");
      CHECK(light.send(life * 10).value() == 1);
      const auto value = co_await light.next(5s);
      CHECK(number(value.value) == life * 10);
      CHECK(value.client.connection() == client.connection());
      CHECK(value.time.seconds > 0);
      CHECK(flashes.send(life * 100).value() == 1);
      for (std::int32_t i = 0; i < 3; ++i) {
        const auto packet = co_await flashes.next(5s);
        CHECK(number(packet.value) == life * 100 + i);
      }
      while (!heat.newest() || number(heat.newest()->value) != 100 + life) co_await client.get("level");
      lamp.stop();
      while (lamps.default_client()) {
        asio::steady_timer pause(io, 1ms);
        co_await pause.async_wait(asio::use_awaitable);
      }
      CHECK(number(light.newest()->value) == life * 10);  // stays
      CHECK(light.send(1).error().code == ErrorCode::invalid_operation);
      lamp.start();
    }
    co_await lamps.client(5s);
  });
  CHECK(connected == 4);
  CHECK(lost == 3);
}

TEST_CASE("a subscription that connects again is not sent what it knows") {
  LampNode lamp;
  asio::io_context io;
  run(io, [&]() -> asio::awaitable<void> {
    auto lamps = subscribe_service(io, lamp.url(), quick());
    std::vector<std::uint64_t> received;
    lamps.on_connected([&](const AsyncObject& client) {
      received.push_back(client.connection()->session().connection().stats().bytes_received);
    });
    for (std::int32_t life = 1; life <= 3; ++life) {
      const auto client = co_await lamps.client(5s);
      const auto level = co_await client.get("level");  // it has the definitions
      CHECK(number(level) == life);
      lamp.stop();
      while (lamps.default_client()) {
        asio::steady_timer pause(io, 1ms);
        co_await pause.async_wait(asio::use_awaitable);
      }
      lamp.start();
    }
    co_await lamps.client(5s);
    REQUIRE(received.size() == 4);
    const auto size = std::string_view(definition).size();
    for (std::size_t i = 1; i < received.size(); ++i) CHECK(received[i] + size < received[0]);
  });
}

TEST_CASE("calls that are under way when a connection is lost fail, and are not repeated") {
  LampNode lamp;
  asio::io_context io;
  run(io, [&]() -> asio::awaitable<void> {
    auto lamps = subscribe_service(io, lamp.url(), quick());
    const auto client = co_await lamps.client(5s);
    std::optional<Error> failure;
    client.connection()->on_closed([](const Error&) {});  // the subscription still hears of it
    try {
      auto pending = client.call("wait");
      client.connection()->close(make_error(ErrorCode::connection_error, "cut"));
      co_await std::move(pending);
    } catch (const ClientException& exception) {
      failure = exception.error();
    }
    REQUIRE(failure);
    CHECK(failure->code == ErrorCode::connection_error);
    const auto next = co_await lamps.client(5s);
    CHECK(next.connection() != client.connection());
  });
}

TEST_CASE("handlers that throw are reported, and the subscription goes on") {
  LampNode lamp;
  asio::io_context io;
  std::vector<std::string> reports;
  int lost = 0;
  run(io, [&]() -> asio::awaitable<void> {
    auto options = quick();
    options.connect.report = [&](const std::string& problem) { reports.push_back(problem); };
    std::vector<std::string> urls{"rr+tcp://127.0.0.1:1/?service=Lamp", lamp.url()};
    auto lamps = subscribe_service(io, urls, options);
    auto dark = lamps.wire("dark");
    int failures = 0;
    lamps.on_connected([](const AsyncObject&) { throw std::runtime_error("of on_connected"); });
    lamps.on_failed([](const Error&, const std::string&) { throw std::runtime_error("of on_failed"); });
    lamps.on_lost([&](const AsyncObject&, const Error&) {
      ++lost;
      throw std::runtime_error("of on_lost");
    });
    dark.on_failed([&](const AsyncObject&, const Error&) {
      ++failures;
      throw std::runtime_error("of a member");
    });
    for (std::int32_t life = 1; life <= 2; ++life) {
      const auto client = co_await lamps.client(5s);
      const auto level = co_await client.get("level");
      CHECK(number(level) == life);
      for (const int before = failures; failures < before + 2;) co_await client.get("level");
      if (life == 2) break;
      lamp.stop();
      while (lamps.default_client()) {
        asio::steady_timer pause(io, 1ms);
        co_await pause.async_wait(asio::use_awaitable);
      }
      lamp.start();
    }
  });
  CHECK(lost == 1);
  const auto told = [&](const std::string& what) {
    return std::count(reports.begin(), reports.end(), "subscription '" + what);
  };
  CHECK(told("connected': its handler failed: of on_connected") == 2);
  CHECK(told("failed': its handler failed: of on_failed") >= 2);
  CHECK(told("lost': its handler failed: of on_lost") == 1);
  CHECK(told("failed of dark': its handler failed: of a member") >= 4);
}

TEST_CASE("each attempt tries the URLs in order, and says which failed") {
  LampNode lamp;
  asio::io_context io;
  std::vector<std::string> failed;
  run(io, [&]() -> asio::awaitable<void> {
    const std::string closed = "rr+tcp://127.0.0.1:1/?service=Lamp";
    std::vector<std::string> urls{closed, lamp.url()};
    auto lamps = subscribe_service(io, urls, quick());
    lamps.on_failed([&](const Error& error, const std::string& url) {
      failed.push_back(url);
      CHECK(error.code == ErrorCode::connection_error);
    });
    co_await lamps.client(5s);
  });
  CHECK(failed == std::vector<std::string>{"rr+tcp://127.0.0.1:1/?service=Lamp"});
}

TEST_CASE("a way that never answers does not keep the next one waiting") {
  LampNode lamp;
  asio::io_context io;
  asio::ip::tcp::acceptor silent(io, {asio::ip::make_address("127.0.0.1"), 0});  // takes no connection
  run(io, [&]() -> asio::awaitable<void> {
    std::vector<std::string> urls;
    urls.push_back("rr+tcp://127.0.0.1:" + std::to_string(silent.local_endpoint().port()) + "/?service=Lamp");
    urls.push_back(lamp.url());
    auto options = quick();
    options.next_url_after = 30ms;
    auto lamps = subscribe_service(io, urls, options);
    co_await lamps.client(3s);
  });
}

TEST_CASE("closing a subscription ends what waits for it, wherever it is") {
  asio::io_context io;
  asio::ip::tcp::acceptor silent(io, {asio::ip::make_address("127.0.0.1"), 0});
  const std::string silent_url =
      "rr+tcp://127.0.0.1:" + std::to_string(silent.local_endpoint().port()) + "/?service=Lamp";
  const std::string nowhere = "rr+tcp://192.0.2.1:48653/?service=Lamp";
  const std::string refused = "rr+tcp://127.0.0.1:1/?service=Lamp";
  const std::string url = std::array{refused, silent_url, nowhere}[GENERATE(0u, 1u, 2u)];
  std::vector<std::string> ends;
  run(io, [&]() -> asio::awaitable<void> {
    SubscriptionOptions options;
    options.first_retry = 10min;
    auto lamps = subscribe_service(io, url, options);
    auto light = lamps.wire("light");
    lamps.client(std::nullopt, [&](std::exception_ptr e, const AsyncObject&) {
      ends.push_back(error_of([&] { std::rethrow_exception(e); }).message);
    });
    light.next(10min, [&](std::exception_ptr e, const ReceivedValue&) {
      ends.push_back(error_of([&] { std::rethrow_exception(e); }).message);
    });
    asio::steady_timer pause(io, 50ms);
    co_await pause.async_wait(asio::use_awaitable);
    CHECK(ends.empty());
    lamps.close();
    CHECK(lamps.is_closed());
    CHECK(light.is_closed());
    Error failure;
    try {
      co_await lamps.client();
    } catch (const ClientException& exception) {
      failure = exception.error();
    }
    CHECK(failure.code == ErrorCode::invalid_operation);
    auto late = lamps.wire("light");
    CHECK(late.is_closed());
    try {
      failure = {};
      co_await late.next();
    } catch (const ClientException& exception) {
      failure = exception.error();
    }
    CHECK(failure.code == ErrorCode::invalid_operation);
  });
  CHECK(ends == std::vector<std::string>{"light: the subscription is closed", "the subscription is closed"});
}

TEST_CASE("a subscription may be closed between two runs of its loop, while the service has not answered") {
  asio::io_context io;
  asio::ip::tcp::acceptor silent(io, {asio::ip::make_address("127.0.0.1"), 0});
  const auto url = "rr+tcp://127.0.0.1:" + std::to_string(silent.local_endpoint().port()) + "/?service=Lamp";
  auto lamps = subscribe_service(io, url, quick());
  asio::ip::tcp::socket client(io);
  std::array<char, 1> first_byte{};
  bool is_asked = false;  // the session is being opened
  silent.async_accept(client, [&](const auto&) {
    client.async_read_some(asio::buffer(first_byte), [&](const auto& error, std::size_t) { is_asked = !error; });
  });
  while (!is_asked && io.run_one_for(5s) > 0) {
  }
  REQUIRE(is_asked);
  lamps.close();
  io.run_for(5s);
  CHECK(io.stopped());  // it was out of work
}

TEST_CASE("a handler may close the subscription, and let go of it") {
  LampNode lamp;
  asio::io_context io;
  std::optional<ServiceSubscription> lamps(subscribe_service(io, lamp.url(), quick()));
  std::optional<WireSubscription> light(lamps->wire("light"));
  const bool in_failure = GENERATE(false, true);
  if (in_failure) lamp.stop();
  const auto let_go = [&] {
    light.reset();
    lamps.reset();
  };
  lamps->on_connected([&](const AsyncObject&) { let_go(); });
  lamps->on_failed([&](const Error&, const std::string&) { let_go(); });
  io.run_for(5s);
  CHECK(io.stopped());
  CHECK_FALSE(lamps);
}

TEST_CASE("waiting for a client can be cancelled, and has an end") {
  asio::io_context io;
  run(io, [&]() -> asio::awaitable<void> {
    using namespace asio::experimental::awaitable_operators;
    auto lamps = subscribe_service(io, "rr+tcp://127.0.0.1:1/?service=Lamp", quick());
    asio::steady_timer pause(io, 20ms);
    const auto first = co_await (lamps.client() || pause.async_wait(asio::use_awaitable));
    CHECK(first.index() == 1);
    Error failure;
    try {
      co_await lamps.client(20ms);
    } catch (const ClientException& exception) {
      failure = exception.error();
    }
    CHECK(failure.code == ErrorCode::request_timeout);
    CHECK_THAT(failure.message, Contains("20 ms"));
  });
}

TEST_CASE("the longest time to wait for a client is long") {
  LampNode lamp;
  asio::io_context io;
  auto options = quick();
  options.connect.connect_timeout = std::chrono::milliseconds::max();
  options.connect.request_timeout = options.connect.connect_timeout;
  run(io, [&]() -> asio::awaitable<void> {
    auto lamps = subscribe_service(io, lamp.url(), options);
    const auto client = co_await lamps.client(std::chrono::milliseconds::max());
    const auto level = co_await client.get("level");
    CHECK(number(level) == 1);
    lamps.close();
  });
}

TEST_CASE("handlers of a subscription keep what they have") {
  LampNode lamp;
  asio::io_context io;
  std::vector<int> connected, lost, failed, values, packets, unconnected;
  const auto counting = [](std::vector<int>& calls) {
    return [&calls, n = 0](const auto&...) mutable { calls.push_back(++n); };
  };
  auto lamps = subscribe_service(io, lamp.url(), quick());
  lamps.on_connected(counting(connected));
  lamps.on_lost(counting(lost));
  lamps.on_failed(counting(failed));
  auto light = lamps.wire("light");
  auto flashes = lamps.pipe("flashes");
  auto missing = lamps.wire("nonesuch");
  light.on_value(counting(values));
  flashes.on_packet(counting(packets));
  missing.on_failed(counting(unconnected));
  const auto serve_until = [&](const auto& is_done) {
    const auto limit = std::chrono::steady_clock::now() + 20s;
    while (!is_done() && std::chrono::steady_clock::now() < limit) io.run_one_for(1s);
    REQUIRE(is_done());
  };
  for (std::size_t life = 1; life <= 2; ++life) {
    serve_until([&] { return light.connected_count() == 1 && flashes.connected_count() == 1; });
    CHECK(light.send(Value(1)).has_value());
    CHECK(flashes.send(Value(1)).has_value());
    serve_until([&] { return values.size() == life && packets.size() == 3 * life && unconnected.size() >= 2 * life; });
    lamp.stop();
    serve_until([&] { return lost.size() == life && failed.size() >= 2; });
    if (life == 1) lamp.start();
  }
  lamps.close();
  io.run();
  for (const auto* calls : {&connected, &lost, &failed, &values, &packets, &unconnected}) {
    std::vector<int> counted(calls->size());
    std::iota(counted.begin(), counted.end(), 1);
    CHECK(*calls == counted);
    CHECK(calls->size() >= 2);
  }
}

TEST_CASE("members that a service does not have are tried again, and told") {
  LampNode lamp;
  asio::io_context io;
  int failures = 0;
  run(io, [&]() -> asio::awaitable<void> {
    auto lamps = subscribe_service(io, lamp.url(), quick());
    auto dark = lamps.wire("dark");
    asio::steady_timer enough(io, asio::steady_timer::time_point::max());
    dark.on_failed([&](const AsyncObject&, const Error& error) {
      CHECK(error.code == ErrorCode::member_not_found);
      if (++failures == 3) enough.expires_after(0s);
    });
    try {
      co_await enough.async_wait(asio::use_awaitable);
    } catch (const boost::system::system_error&) {
    }
  });
  CHECK(failures == 3);
}

TEST_CASE("packets that nobody takes are bounded: the oldest go") {
  LampNode lamp;
  asio::io_context io;
  run(io, [&]() -> asio::awaitable<void> {
    auto lamps = subscribe_service(io, lamp.url(), quick());
    MemberSubscriptionOptions two;
    two.packet_limit = 2;
    auto flashes = lamps.pipe("flashes", two);
    const auto client = co_await lamps.client(5s);
    while (flashes.connected_count() == 0) co_await client.get("level");
    REQUIRE(flashes.send(5));
    while (flashes.dropped() == 0) co_await client.get("level");
    CHECK(flashes.available() == 2);
    const auto packet = co_await flashes.next();
    CHECK(number(packet.value) == 6);
    two.packet_limit = 0;
    auto none = lamps.pipe("flashes", two);
    while (none.connected_count() == 0) co_await client.get("level");
    REQUIRE(none.send(5));
    while (none.dropped() < 3) co_await client.get("level");
    CHECK(none.available() == 0);
    MemberSubscriptionOptions few_bytes;
    few_bytes.byte_limit = 1;
    auto newest = lamps.pipe("flashes", few_bytes);
    while (newest.connected_count() == 0) co_await client.get("level");
    REQUIRE(newest.send(5));
    while (newest.dropped() < 2) co_await client.get("level");
    CHECK(newest.available() == 1);
    const auto kept = co_await newest.next();
    CHECK(number(kept.value) == 7);
    REQUIRE(newest.send(8));
    while (newest.dropped() < 4) co_await client.get("level");
    CHECK(newest.available() == 1);
  });
}

TEST_CASE("what cannot be subscribed to is refused at once") {
  asio::io_context io;
  CHECK_THAT(refusal([&] { subscribe_service(io, std::vector<std::string>{}); }), Contains("no URL"));
  CHECK_THAT(refusal([&] {
               subscribe_service(io, std::vector<std::string>{"rr+tcp://a:1/?service=A", "rr+tcp://a:1/?service=B"});
             }),
             Contains("'A', 'B'") || Contains("\"A\", \"B\""));
  CHECK_THAT(refusal([&] { subscribe_service(io, "nowhere"); }), Contains("nowhere"));
  auto lamps = subscribe_service(io, "rr+tcp://127.0.0.1:1/?service=Lamp");
  MemberSubscriptionOptions options;
  options.path = "bulb";
  CHECK_THAT(refusal([&] { lamps.wire("heat", options); }), Contains("\"*\""));
}

TEST_CASE("a subscription of a wire that is closed leaves the wire to one that was made since") {
  LampNode lamp;
  asio::io_context io;
  run(io, [&]() -> asio::awaitable<void> {
    auto lamps = subscribe_service(io, lamp.url(), quick());
    const auto client = co_await lamps.client(5s);
    auto first = lamps.wire("light");
    first.close();  // its connect is not answered yet
    auto second = lamps.wire("light");
    while (second.connected_count() == 0) co_await client.get("level");
    CHECK(second.send(7).value() == 1);
    const auto seven = co_await second.next(5s);
    CHECK(number(seven.value) == 7);
    auto third = lamps.wire("light");
    while (third.connected_count() == 0) co_await client.get("level");
    second.close();
    co_await client.get("level");
    CHECK(third.send(8).value() == 1);
    const auto eight = co_await third.next(5s);
    CHECK(number(eight.value) == 8);
  });
}
