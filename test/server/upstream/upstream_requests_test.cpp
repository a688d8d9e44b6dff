// What clients ask a device by one session, generators among it, and what it asks them.
#include "test/server/upstream/counting_device.hpp"

using namespace rrgate;
using namespace rrgate::test;
using namespace std::chrono_literals;

namespace {

/// A generator whose values come late.
struct Hanging {
  int asked = 0;
  int closed = 0;
  int aborted = 0;
  std::vector<std::shared_ptr<rr::LateCall>> calls;

  explicit Hanging(rr::Service& service) {
    service.generator("count", [this] {
      rr::Generator made;
      made.start = [this](rr::Value, const std::shared_ptr<rr::LateCall>& call) {
        ++asked;
        calls.push_back(call);
      };
      made.close = [this] { ++closed; };
      made.abort = [this] { ++aborted; };
      return made;
    });
  }
  void answer() {
    for (const auto& call : std::exchange(calls, {})) call->answer(rr::Value(std::int32_t{1}));
  }
};

}  // namespace

TEST_CASE("a generator that opens when its client has gone is nobody else's") {
  Counting device;
  UpstreamBench bench(device.service);
  bench.open();
  std::optional<HearingClient> client(std::in_place, bench.upstream);
  const auto* address = &*client;
  const auto opened = bench.ask(*client, rr::CallKind::generator_open, "bench", "count", 1);
  client.reset();
  client.emplace(bench.upstream);
  REQUIRE(&*client == address);
  REQUIRE(bench.run_until([&] { return opened->has_value(); }));
  CHECK(bench.run_until([&] { return device.open_generators() == 0; }));
  const auto next = bench.ask(*client, rr::CallKind::generator_next, "bench", "count", 1);
  REQUIRE(bench.run_until([&] { return next->has_value(); }));
  REQUIRE_FALSE((**next).has_value());
  CHECK((*next)->error().code == rr::ErrorCode::invalid_operation);
}

TEST_CASE("a device that takes too long has the time for its answer that the configuration gives it") {
  Counting device;
  UpstreamBench bench(device.service);
  answer_within(bench, 100ms);
  bench.open();
  HearingClient client(bench.upstream);
  const auto asked = bench.ask(client, rr::CallKind::function, "bench", "wait");
  REQUIRE(bench.run_until([&] { return asked->has_value(); }));
  REQUIRE_FALSE((**asked).has_value());
  CHECK((*asked)->error().code == rr::ErrorCode::request_timeout);
}

TEST_CASE("a generator whose value comes too late is the client's still, to be ended at the device") {
  Counting device;
  Hanging hanging(*device.service);
  UpstreamBench bench(device.service);
  answer_within(bench, 200ms);
  bench.open();
  std::optional<HearingClient> client(std::in_place, bench.upstream);
  const auto opened = bench.ask(*client, rr::CallKind::generator_open, "bench", "count", 1);
  REQUIRE(bench.run_until([&] { return opened->has_value(); }));
  const auto next = bench.ask(*client, rr::CallKind::generator_next, "bench", "count", 1);
  REQUIRE(bench.run_until([&] { return next->has_value(); }));
  REQUIRE(hanging.asked == 1);
  REQUIRE_FALSE((**next).has_value());
  CHECK((*next)->error().code == rr::ErrorCode::request_timeout);
  SECTION("by the client") {
    const auto aborted = bench.ask(*client, rr::CallKind::generator_abort, "bench", "count", 1);
    REQUIRE(bench.run_until([&] { return aborted->has_value(); }));
    CHECK((**aborted).has_value());
    CHECK(hanging.aborted == 1);
  }
  SECTION("when the client leaves") {
    client.reset();
    bench.find("bench.others[1]");
    hanging.answer();  // until then it is not closed
    CHECK(bench.run_until([&] { return hanging.closed == 1; }));
  }
}

TEST_CASE("a generator whose step is too large to be sent is ended at the device, which knows nothing of it") {
  Counting device;
  UpstreamBench bench(device.service);
  bench.open();
  HearingClient client(bench.upstream);
  const auto opened = bench.ask(client, rr::CallKind::generator_open, "bench", "fill", 1);
  REQUIRE(bench.run_until([&] { return opened->has_value(); }));
  REQUIRE(device.open_generators() == 1);
  const auto next = bench.ask(client, rr::CallKind::generator_next, "bench", "fill", 1,
                              {rr::Value(std::vector<std::uint8_t>(13'000'000))});
  REQUIRE(bench.run_until([&] { return next->has_value(); }));
  REQUIRE_FALSE((**next).has_value());
  CHECK_FALSE(bench.upstream->has_generator(client, 1));
  CHECK(bench.run_until([&] { return device.open_generators() == 0; }));
}

TEST_CASE("what a device was asked when its service ended is told to be lost with the connection") {
  Counting device;
  UpstreamBench bench(device.service);
  bench.open();
  HearingClient client(bench.upstream);
  const auto asked = bench.ask(client, rr::CallKind::function, "bench", "wait");
  REQUIRE(bench.run_until([&] { return device.waiting.has_value(); }));
  bench.node.stop();
  REQUIRE(bench.run_until([&] { return asked->has_value(); }));
  REQUIRE_FALSE((**asked).has_value());
  CHECK((*asked)->error().message == "connection_lost: device 'device': the service was closed");
}

TEST_CASE("a client that has left asks the device for nothing") {
  Counting device;
  UpstreamBench bench(device.service);
  bench.open();
  HearingClient client(bench.upstream);
  bench.upstream->remove(client);
  const auto asked = bench.ask(client, rr::CallKind::function, "bench", "stop");
  REQUIRE(bench.run_until([&] { return asked->has_value(); }));
  REQUIRE_FALSE((**asked).has_value());
  CHECK((*asked)->error().code == rr::ErrorCode::operation_cancelled);
  bench.find("bench");
  CHECK(device.commands.empty());
}

TEST_CASE("reads are shared, but whoever reads behind a command hears what has come of it") {
  Counting device;
  UpstreamBench bench(device.service);
  auto config = bench.device->config();
  config.shares_reads = true;
  bench.device->become(config, bench.config);
  bench.open();
  HearingClient client(bench.upstream);
  HearingClient other(bench.upstream);
  const auto read = [&](HearingClient& by) { return bench.ask(by, rr::CallKind::property_get, "bench", "number"); };
  const auto first = read(client);
  const auto second = read(other);
  const auto written =
      bench.ask(client, rr::CallKind::property_set, "bench", "number", 0, {rr::Value(std::int32_t{2})});
  const auto third = read(client);
  const auto fourth = read(other);
  REQUIRE(bench.run_until([&] { return fourth->has_value() && third->has_value() && written->has_value(); }));
  const auto value_of = [](const auto& asked) { return asked->value()->template to<std::int32_t>().value(); };
  CHECK(value_of(first) == 1);
  CHECK(value_of(second) == 1);
  CHECK(value_of(third) == 2);
  CHECK(value_of(fourth) == 2);
  CHECK(device.reads == 2);
}

TEST_CASE("a client that is gone is not asked with all others, and the device has its answer") {
  Counting device;
  rr::ClientId session = 0;
  device.service->on_client_connected([&](rr::ClientId id) { session = id; });
  UpstreamBench bench(device.service);
  auto config = bench.device->config();
  config.callbacks = {{"bench.ask", CallbackPolicy::all}};
  bench.device->become(config, bench.config);
  bench.open();
  HearingClient first(bench.upstream);
  std::optional<HearingClient> second(std::in_place, bench.upstream);
  int asked = 0;
  second->on_callback = [&](const auto&) { ++asked; };
  first.on_callback = [&](const auto& answer) {
    second.reset();
    answer(rr::make_error(rr::ErrorCode::operation_failed, "not this one"));
  };
  std::optional<rr::Result<rr::Value>> heard;
  device.service->call_callback(session, "ask", {}, [&](rr::Result<rr::Value> answer) { heard = std::move(answer); });
  CHECK(bench.run_until([&] { return heard.has_value(); }));
  CHECK(asked == 0);
  CHECK((heard && !*heard));
}
