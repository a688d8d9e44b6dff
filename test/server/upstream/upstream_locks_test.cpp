// Locks, monitors and leases of clients that share a session with a device.
#include <thread>

#include "test/server/upstream/counting_device.hpp"

using namespace rrgate;
using namespace rrgate::test;
using namespace std::chrono_literals;

namespace {

/// Two clients of a device with an object below its root, and leases.
struct LockBench {
  Counting device;
  std::shared_ptr<rr::Object> part = device.service->make_object("Part");
  UpstreamBench bench;
  HearingClient first;
  HearingClient second;
  rr::LockRequestId last = 0;

  LockBench() : bench(with_part(), {.is_offered = true}), first(bench.upstream), second(bench.upstream) {
    bench.open();
    REQUIRE(bench.find("bench.parts[1]").has_value());
  }

  std::shared_ptr<rr::Service> with_part() {
    part->allow_monitor();
    device.service->root().objref("parts", [this](std::string_view) { return part; });
    return device.service;
  }

  /// The answer, once it is there.
  auto begin(HearingClient& client, rr::LockCommand command, const std::string& path) {
    rr::LockWanted wanted;
    wanted.id = ++last;
    wanted.command = command;
    wanted.path = path;
    wanted.timeout = 10s;
    const auto answer = std::make_shared<std::optional<rr::ErrorCode>>();
    bench.upstream->lock(client, wanted, [answer](const rr::Result<>& result) {
      *answer = result ? rr::ErrorCode::none : result.error().code;
    });
    return answer;
  }

  rr::ErrorCode ask(HearingClient& client, rr::LockCommand command, const std::string& path) {
    const auto answer = begin(client, command, path);
    REQUIRE(bench.run_until([&] { return answer->has_value(); }));
    return **answer;
  }
};

}  // namespace

TEST_CASE("a client that goes on as another user hears what has become of what it waits for") {
  Counting device;
  device.service->root().allow_monitor();
  UpstreamBench bench(device.service);
  bench.open();
  HearingClient first(bench.upstream);
  HearingClient second(bench.upstream);
  std::vector<bool> answers;
  const auto enter = [&](HearingClient& client) {
    rr::LockWanted wanted;
    wanted.id = 1;
    wanted.command = rr::LockCommand::enter_monitor;
    wanted.path = "bench";
    wanted.timeout = -1ms;
    bench.upstream->lock(client, wanted, [&](const rr::Result<>& result) { answers.push_back(result.has_value()); });
  };
  enter(first);
  REQUIRE(bench.run_until([&] { return answers.size() == 1; }));
  enter(second);
  bench.upstream->change_user(second);
  CHECK(bench.run_until([&] { return answers.size() == 2; }));
  CHECK(answers == std::vector{true, false});
}

TEST_CASE("a client that has left is nobody's any more, as whatever user it would go on") {
  Counting device;
  UpstreamBench bench(device.service);
  bench.open();
  HearingClient client(bench.upstream);
  bench.upstream->remove(client);
  bench.upstream->change_user(client);
  bool is_answered = false;
  rr::LockWanted wanted;
  wanted.command = rr::LockCommand::enter_monitor;
  wanted.path = "bench";
  bench.upstream->lock(client, wanted, [&](const rr::Result<>&) { is_answered = true; });
  bench.find("bench");
  CHECK_FALSE(is_answered);
}

TEST_CASE("a session that is lost because a lease has ended refuses whoever has found that out") {
  Counting device;
  LeaseConfig leases;
  leases.is_offered = true;
  UpstreamBench bench(device.service, leases);
  bench.open();
  HearingClient holder(bench.upstream);
  HearingClient other(bench.upstream);
  holder.on_lease_ended = [&] {
    bench.upstream->connection()->close(rr::make_error(rr::ErrorCode::connection_error, "the line was cut"));
    bench.run_until([&] { return !bench.upstream->is_open(); });
  };
  take_lease(bench, bench.upstream, holder, 100ms);
  std::this_thread::sleep_for(150ms);
  const auto asked = bench.ask(other, rr::CallKind::function, "bench", "stop");
  REQUIRE(asked->has_value());
  CHECK((*asked)->error().code == rr::ErrorCode::connection_error);
}

TEST_CASE("thousands who wait for monitors of a device that is lost are all told") {
  Counting device;
  UpstreamBench bench(device.service);
  bench.open();
  constexpr std::size_t count = 6000;
  std::vector<std::unique_ptr<HearingClient>> clients;
  std::size_t answers = 0;
  for (std::size_t i = 0; i < count; ++i) {
    auto& client = *clients.emplace_back(std::make_unique<HearingClient>(bench.upstream));
    rr::LockWanted wanted;
    wanted.id = 1;
    wanted.command = rr::LockCommand::enter_monitor;
    wanted.path = i % 8 == 0 ? "bench" : "bench.others[" + std::to_string(i % 8) + "]";
    wanted.timeout = -1ms;
    bench.upstream->lock(client, wanted, [&](const rr::Result<>&) { ++answers; });
  }
  bench.upstream->break_off();
  CHECK(bench.run_until([&] { return answers == count; }));
}

TEST_CASE("no lease is given above an object that another client has locked") {
  LockBench locks;
  CHECK(locks.ask(locks.first, rr::LockCommand::enter_monitor, "bench.parts[1]") == rr::ErrorCode::none);
  CHECK(locks.ask(locks.second, rr::LockCommand::acquire_lease, "bench") == rr::ErrorCode::object_locked_error);
  CHECK(locks.ask(locks.first, rr::LockCommand::acquire_lease, "bench") == rr::ErrorCode::none);
}

TEST_CASE("who waits for a monitor gets none below a lease that its holder has taken meanwhile") {
  LockBench locks;
  auto& holder = locks.first;
  auto& waiter = locks.second;
  CHECK(locks.ask(holder, rr::LockCommand::enter_monitor, "bench.parts[1]") == rr::ErrorCode::none);
  const auto waiting = locks.begin(waiter, rr::LockCommand::enter_monitor, "bench.parts[1]");
  CHECK(locks.ask(holder, rr::LockCommand::acquire_lease, "bench") == rr::ErrorCode::none);
  CHECK(locks.ask(holder, rr::LockCommand::exit_monitor, "bench.parts[1]") == rr::ErrorCode::none);
  REQUIRE(locks.bench.run_until([&] { return waiting->has_value(); }));
  CHECK(**waiting == rr::ErrorCode::object_locked_error);
  CHECK(locks.ask(waiter, rr::LockCommand::enter_monitor, "bench.parts[1]") == rr::ErrorCode::object_locked_error);
  CHECK(locks.ask(holder, rr::LockCommand::release_lease, "bench") == rr::ErrorCode::none);
  CHECK(locks.ask(waiter, rr::LockCommand::enter_monitor, "bench.parts[1]") == rr::ErrorCode::none);
}
