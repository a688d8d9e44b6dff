// Monitor locks alone, without sessions: what is bounded, and what makes room.
#include "core/session/service/monitor_locks.hpp"

#include <catch2/catch.hpp>
#include <memory>
#include <vector>

#include "test/core/session/loopback.hpp"
#include "test/support/print.hpp"

using namespace rr;
using namespace rr::test;
using namespace std::chrono_literals;

namespace {

constexpr std::size_t most = 1024;  // monitors, and clients that wait for one

struct Monitors {
  MonitorLocks locks = {};
  Now now = {TimePoint(1000s), {}};

  static std::shared_ptr<ServiceObject> object() { return std::make_shared<PlainObject>("experimental.loopback.Arm"); }
  Result<MonitorLocks::State> enter(const std::shared_ptr<ServiceObject>& object, SessionId session,
                                    std::chrono::milliseconds timeout = -1ms) {
    return locks.enter(object, session, timeout, now);
  }
};

}  // namespace

TEST_CASE("so many objects can be monitor locked, and further ones when others are free") {
  Monitors monitors;
  std::vector<std::shared_ptr<ServiceObject>> objects;
  for (std::size_t i = 0; i < most; ++i) {
    objects.push_back(Monitors::object());
    REQUIRE(monitors.enter(objects.back(), 1).value() == MonitorLocks::State::owned);
  }
  const auto late = Monitors::object();
  CHECK(monitors.enter(late, 1).error().code == ErrorCode::out_of_system_resource);
  CHECK(monitors.enter(objects[7], 2).value() == MonitorLocks::State::waiting);  // one that is known needs no room
  CHECK(monitors.locks.exit(*objects[0], 1, monitors.now));
  CHECK(monitors.enter(late, 1).value() == MonitorLocks::State::owned);
  CHECK(monitors.enter(Monitors::object(), 1).error().code == ErrorCode::out_of_system_resource);
  objects[1].reset();
  CHECK(monitors.enter(Monitors::object(), 1).value() == MonitorLocks::State::owned);
}

TEST_CASE("an object goes whether or not its monitor was entered, and one at its address has a monitor of its own") {
  Monitors monitors;
  PlainObject place("experimental.loopback.Arm");
  const auto object_there = [&] { return std::shared_ptr<ServiceObject>(&place, [](ServiceObject*) {}); };
  auto object = object_there();
  const std::weak_ptr<ServiceObject> first = object;
  CHECK(monitors.enter(object, 1).value() == MonitorLocks::State::owned);
  SECTION("left") {
    CHECK(monitors.locks.exit(*object, 1, monitors.now).value());
  }
  SECTION("still owned, and waited for") {
    CHECK(monitors.enter(object, 2).value() == MonitorLocks::State::waiting);
  }
  object.reset();
  CHECK(first.expired());
  object = object_there();
  CHECK(monitors.locks.check(*object, 3, monitors.now));
  CHECK_FALSE(monitors.locks.exit(*object, 3, monitors.now).value());  // it was never locked
  CHECK(monitors.enter(object, 3).value() == MonitorLocks::State::owned);
  CHECK_FALSE(monitors.locks.has_waiting());
}

TEST_CASE("so many clients can wait for a monitor, and further ones when others have left") {
  Monitors monitors;
  const auto object = Monitors::object();
  CHECK(monitors.enter(object, 1).value() == MonitorLocks::State::owned);
  for (SessionId session = 2; session < 2 + most; ++session)
    REQUIRE(monitors.enter(object, session).value() == MonitorLocks::State::waiting);
  CHECK(monitors.enter(object, 5000).error().code == ErrorCode::out_of_system_resource);
  CHECK(monitors.enter(object, 5000, 0ms).error().code == ErrorCode::operation_timeout);
  monitors.locks.remove_session(2);
  CHECK(monitors.enter(object, 5000).value() == MonitorLocks::State::waiting);
  CHECK(monitors.enter(object, 5001).error().code == ErrorCode::out_of_system_resource);
}

TEST_CASE("who waits is let in in turn, but for those whose time is over") {
  Monitors monitors;
  const auto object = Monitors::object();
  CHECK(monitors.enter(object, 1).value() == MonitorLocks::State::owned);
  CHECK(monitors.enter(object, 2, 100ms).value() == MonitorLocks::State::waiting);
  CHECK(monitors.enter(object, 3, 10s).value() == MonitorLocks::State::waiting);
  CHECK(monitors.locks.next_change(*object, 2) == monitors.now.steady + 100ms);
  monitors.now.steady += 100ms;
  CHECK(monitors.locks.exit(*object, 1, monitors.now).value());
  CHECK(monitors.locks.look(*object, 3, monitors.now).value() == MonitorLocks::State::owned);
  CHECK(monitors.locks.look(*object, 2, monitors.now).error().code == ErrorCode::operation_timeout);
  CHECK(monitors.locks.look(*object, 2, monitors.now).error().code == ErrorCode::invalid_operation);  // it ended
  CHECK_FALSE(monitors.locks.has_waiting());
}
