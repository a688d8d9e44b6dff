// The gateway's session with a device: how it is kept open, when it rests, and who hears of its clients' leaving.
#include "server/upstream/upstream.hpp"

#include <boost/asio/steady_timer.hpp>

#include "test/server/upstream/counting_device.hpp"

using namespace rrgate;
using namespace rrgate::test;
using namespace std::chrono_literals;

namespace {

/// When a session is opened that is lost at once.
struct Attempts {
  std::vector<std::chrono::steady_clock::time_point> times;
  std::chrono::milliseconds gap(std::size_t after) const {
    return std::chrono::duration_cast<std::chrono::milliseconds>(times.at(after + 1) - times.at(after));
  }
};

}  // namespace

TEST_CASE("a client that leaves while an event is handed out hears nothing of it; all others do") {
  Counting device;
  UpstreamBench bench(device.service);
  bench.open();
  std::vector<std::string> heard;
  HearingClient first(bench.upstream);
  std::optional<HearingClient> second(std::in_place, bench.upstream);
  HearingClient third(bench.upstream);
  first.on_event = [&](rr::EventPacket&) {
    heard.push_back("first");
    second.reset();
  };
  second->on_event = [&](rr::EventPacket&) { heard.push_back("second"); };
  third.on_event = [&](rr::EventPacket&) { heard.push_back("third"); };
  device.service->fire("struck", 1);
  CHECK(bench.run_until([&] { return heard.size() == 2; }));
  device.service->fire("struck", 2);
  CHECK(bench.run_until([&] { return heard.size() == 4; }));
  CHECK(heard == std::vector<std::string>{"first", "third", "first", "third"});
}

TEST_CASE("a device that drops each session at once is tried ever more rarely, until one has lasted") {
  Counting device;
  UpstreamBench bench(device.service);
  Attempts attempts;
  constexpr std::size_t lasting = 4;
  bench.keep_open({40ms, 10s, 10s}, [&]() -> rr::Result<> {
    attempts.times.push_back(std::chrono::steady_clock::now());
    if (attempts.times.size() - 1 != lasting) bench.upstream->break_off();
    return {};
  });
  REQUIRE(bench.run_until([&] { return attempts.times.size() == lasting + 1; }));
  CHECK(attempts.gap(0) >= 20ms);  // at least half of 40 ms, 80 ms, ...
  CHECK(attempts.gap(2) >= 80ms);
  CHECK(attempts.gap(3) >= 160ms);
  boost::asio::steady_timer while_it_lasts(bench.io, 450ms);
  bool has_lasted = false;
  while_it_lasts.async_wait([&](const auto&) { has_lasted = true; });
  REQUIRE(bench.run_until([&] { return has_lasted; }));
  const auto lost = std::chrono::steady_clock::now();
  bench.upstream->break_off();
  REQUIRE(bench.run_until([&] { return attempts.times.size() == lasting + 2; }));
  CHECK(attempts.times.back() - lost < 320ms);  // half of what would come next, had it not lasted
}

TEST_CASE("what a reload says of retries holds from the next wait on") {
  Counting device;
  UpstreamBench bench(device.service);
  int attempts = 0;
  bench.keep_open({10ms, 20ms, 10s}, [&]() -> rr::Result<> {
    if (++attempts == 1) bench.set_retry({1h, 1h, 10s});
    if (attempts == 2) bench.set_retry({10ms, 20ms, 10s});
    bench.upstream->break_off();
    return {};
  });
  REQUIRE(bench.run_until([&] { return attempts == 1 && !bench.upstream->is_open(); }));
  boost::asio::steady_timer would_have_retried(bench.io, 100ms);
  bool is_over = false;
  would_have_retried.async_wait([&](const auto&) { is_over = true; });
  REQUIRE(bench.run_until([&] { return is_over; }));
  CHECK(attempts == 1);
  bench.upstream->retry_now();
  CHECK(bench.run_until([&] { return attempts >= 3; }));
}

TEST_CASE("who waits for a session that is lost as soon as it is open hears that; the next one gets in") {
  Counting device;
  UpstreamBench bench(device.service);
  bool is_first = true;
  bench.keep_open({10s, 10s, 10s}, [&]() -> rr::Result<> {
    const auto cut = rr::make_error(rr::ErrorCode::connection_error, "the line was cut");
    if (std::exchange(is_first, false)) bench.upstream->connection()->close(cut);
    return {};
  });
  const auto first = bench.wait_for(bench.upstream->opened());
  REQUIRE_FALSE(first.has_value());
  CHECK(first.error().message == "connection_lost: device 'device': the line was cut");
  CHECK(bench.wait_for(bench.upstream->opened()).has_value());
  CHECK(bench.upstream->is_open());
}

TEST_CASE("a session that nobody has wanted yet rests once it is known what the service is; one that is wanted stays") {
  Counting device;
  UpstreamBench bench(device.service);
  bench.upstream->rest_unused(1h);
  bench.keep_open({10s, 10s, 10s});
  REQUIRE(bench.run_until([&] { return bench.upstream->is_resting(); }));
  CHECK(bench.upstream->has_tried());
  REQUIRE(bench.upstream->types());
  CHECK(bench.upstream->types()->find_entity("test.bench.Bench"));
  CHECK(bench.run_until([&] { return bench.node.client_count() == 0; }));
  CHECK(bench.wait_for(bench.upstream->opened()).has_value());
  CHECK(bench.find("bench").has_value());
  CHECK(bench.upstream->is_open());
}

TEST_CASE("a session that a client is about to use has its time without clients from then on") {
  Counting device;
  UpstreamBench bench(device.service);
  bench.upstream->wake();
  bench.upstream->rest_unused(1s);
  bench.keep_open({10s, 20s, 10s});
  REQUIRE(bench.run_until([&] { return bench.upstream->is_open(); }));
  const auto end = std::chrono::steady_clock::now() + 1500ms;
  REQUIRE(bench.run_until([&] {
    bench.upstream->wake();
    return bench.upstream->is_resting() || std::chrono::steady_clock::now() > end;
  }));
  CHECK_FALSE(bench.upstream->is_resting());
  CHECK(bench.run_until([&] { return bench.upstream->is_resting(); }));
}

TEST_CASE("a session that is held does not rest until it is let go") {
  Counting device;
  UpstreamBench bench(device.service);
  bench.upstream->hold(true);
  bench.upstream->rest_unused(20ms);
  bench.keep_open({10ms, 20ms, 10s});
  REQUIRE(bench.run_until([&] { return bench.upstream->is_open(); }));
  bool has_passed = false;
  boost::asio::steady_timer while_it_is_held(bench.io, 100ms);
  while_it_is_held.async_wait([&](const auto&) { has_passed = true; });
  REQUIRE(bench.run_until([&] { return has_passed; }));
  CHECK_FALSE(bench.upstream->is_resting());
  bench.upstream->hold(false);
  CHECK(bench.run_until([&] { return bench.upstream->is_resting(); }));
}
