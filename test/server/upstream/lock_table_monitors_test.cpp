// Monitors of a service that many clients share.
#include "test/server/upstream/lock_transcript.hpp"

using namespace rrgate;
using namespace rrgate::test;
using rr::ErrorCode;
using rr::LockCommand;
using std::chrono::milliseconds;
using std::chrono::seconds;

TEST_CASE("clients that share a session take turns in a monitor") {
  Transcript t;
  const auto first = t.shares(1), second = t.shares(2), third = t.shares(3);
  t.takes(first, LockCommand::enter_monitor);
  CHECK(t.may(first));
  CHECK(t.use(second) == ErrorCode::invalid_operation);
  CHECK(t.use(second, "s", true) == ErrorCode::invalid_operation);
  CHECK(t.may(second, "s.tool"));
  t.wants(first, LockCommand::enter_monitor);
  t.answered(first, ErrorCode::invalid_operation);
  t.wants(second, LockCommand::enter_monitor);
  t.wants(third, LockCommand::enter_monitor);
  t.nothing_more();
  t.wants(first, LockCommand::exit_monitor);
  t.device_says(t.asked(LockCommand::exit_monitor));
  t.answered(first);
  t.device_says(t.asked(LockCommand::enter_monitor));
  t.answered(second);
  CHECK_FALSE(t.may(first));
  CHECK(t.may(second));
  t.table.remove(second, t.now);
  t.device_says(t.asked(LockCommand::exit_monitor));
  t.device_says(t.asked(LockCommand::enter_monitor));
  t.left(second);
  t.answered(third);
  CHECK(t.may(third));
}

TEST_CASE("who waits for a monitor waits no longer than he wants to") {
  Transcript t;
  const auto first = t.shares(1), second = t.shares(2);
  t.takes(first, LockCommand::enter_monitor);
  t.wants(second, LockCommand::enter_monitor, "s", milliseconds(0));
  t.answered(second, ErrorCode::operation_timeout);
  t.wants(second, LockCommand::enter_monitor, "s", milliseconds(100));
  CHECK(t.table.poll_timeout() == t.now + milliseconds(100));
  t.now += milliseconds(100);
  t.table.handle_timeout(t.now);
  t.answered(second, ErrorCode::operation_timeout);
  t.wants(second, LockCommand::enter_monitor);
  t.wants(second, LockCommand::exit_monitor);
  t.answered(second, ErrorCode::invalid_operation);  // the wait
  t.answered(second, ErrorCode::invalid_operation);
  t.wants(first, LockCommand::exit_monitor);
  t.device_says(t.asked(LockCommand::exit_monitor));
  t.answered(first);
  t.nothing_more();
}

TEST_CASE("so many clients can wait for a monitor, and so many objects can be monitor locked") {
  constexpr LockClient most = 1024;
  Transcript t;
  const auto owner = t.shares(1);
  t.takes(owner, LockCommand::enter_monitor);
  for (LockClient client = 2; client < most + 2; ++client) t.wants(t.shares(client), LockCommand::enter_monitor);
  t.nothing_more();
  const auto late = t.shares(most + 2);
  t.wants(late, LockCommand::enter_monitor);
  t.answered(late, ErrorCode::out_of_system_resource);
  t.table.remove(2, t.now);
  t.left(2);
  t.wants(late, LockCommand::enter_monitor);
  t.nothing_more();  // it waits
  for (LockClient i = 1; i < most; ++i)
    t.takes(owner, LockCommand::enter_monitor, shared, "s.parts[" + std::to_string(i) + "]");
  t.wants(owner, LockCommand::enter_monitor, "s.one_more");
  t.answered(owner, ErrorCode::out_of_system_resource);
}

TEST_CASE("who has had enough while the device is asked for a monitor leaves others theirs") {
  Transcript t;
  const auto first = t.shares(1), second = t.shares(2);
  t.wants(first, LockCommand::enter_monitor);
  const auto ask = t.asked(LockCommand::enter_monitor);
  t.wants(second, LockCommand::exit_monitor);
  t.answered(second, ErrorCode::invalid_operation);
  t.nothing_more();
  t.wants(first, LockCommand::exit_monitor);
  t.answered(first, ErrorCode::invalid_operation);
  t.answered(first, ErrorCode::invalid_operation);  // its entering
  t.device_says(ask);
  t.device_says(t.asked(LockCommand::exit_monitor));
  CHECK(t.may(second));
  CHECK(t.table.is_empty());
  t.nothing_more();
}

TEST_CASE("a monitor of a client with a session of its own ends with it, and goes to the next") {
  Transcript t;
  const auto owner = t.has_own(1, "alice", alices), waiting = t.shares(2);
  t.takes(owner, LockCommand::enter_monitor, alices);
  t.wants(waiting, LockCommand::enter_monitor);
  t.nothing_more();
  t.table.remove(owner, t.now);
  const auto ask = t.asked(LockCommand::enter_monitor);
  t.left(owner);
  t.device_says(ask);
  t.answered(waiting);
  CHECK(t.may(waiting));
}

TEST_CASE("a session that is lost takes no monitor of another with it") {
  Transcript t;
  const auto alice = t.has_own(1, "alice", alices), other = t.shares(2);
  t.takes(alice, LockCommand::enter_monitor, alices);
  t.table.handle_lost(shared, t.now);
  CHECK(t.may(alice));
  CHECK(t.use(other) == ErrorCode::invalid_operation);
  t.nothing_more();
}

TEST_CASE("an idle owner has lost its monitor in that moment, also where nobody waits") {
  Transcript t;
  const auto first = t.shares(1), second = t.shares(2);
  t.takes(first, LockCommand::enter_monitor);
  t.now += seconds(25) - milliseconds(1);
  CHECK_FALSE(t.may(second));
  t.now += milliseconds(1);
  CHECK(t.may(second));
  CHECK_FALSE(t.may(first));
  t.asked(LockCommand::exit_monitor);
}

TEST_CASE("the owner of a monitor who is idle has lost it, and is told") {
  Transcript t;
  const auto first = t.shares(1), second = t.shares(2);
  t.takes(first, LockCommand::enter_monitor);
  t.now += seconds(20);
  CHECK(t.may(first));
  t.wants(second, LockCommand::enter_monitor);
  CHECK(t.table.poll_timeout() == t.now + seconds(25));
  t.now += seconds(25);
  t.table.handle_timeout(t.now);
  const auto ask = t.asked(LockCommand::exit_monitor);
  CHECK_FALSE(t.may(first));
  t.device_says(ask, ErrorCode::invalid_operation);  // the device knows it already
  t.device_says(t.asked(LockCommand::enter_monitor));
  t.answered(second);
  CHECK(t.may(second));
  CHECK_FALSE(t.may(first));
  t.wants(second, LockCommand::exit_monitor);
  t.device_says(t.asked(LockCommand::exit_monitor));
  t.answered(second);
  CHECK(t.use(first) == ErrorCode::invalid_operation);  // still: he has not said that he knows
  t.wants(first, LockCommand::exit_monitor);
  t.answered(first);
  CHECK(t.may(first));
}

TEST_CASE("the owner of a monitor that was lost with the device is told") {
  Transcript t;
  const auto first = t.shares(1), second = t.shares(2);
  t.takes(first, LockCommand::enter_monitor);
  t.wants(second, LockCommand::enter_monitor);
  t.table.handle_lost(shared, t.now);
  CHECK(t.use(first) == ErrorCode::invalid_operation);
  t.device_says(t.asked(LockCommand::enter_monitor), ErrorCode::connection_error);
  t.answered(second, ErrorCode::connection_error);
  CHECK(t.may(second));
  CHECK(t.use(first) == ErrorCode::invalid_operation);
  t.takes(first, LockCommand::enter_monitor);
  CHECK(t.may(first));
  CHECK_FALSE(t.may(second));
}

TEST_CASE("a monitor that the device gives to one who has left goes to the next") {
  Transcript t;
  const auto first = t.shares(1), second = t.shares(2);
  t.wants(first, LockCommand::enter_monitor);
  const auto ask = t.asked(LockCommand::enter_monitor);
  CHECK_FALSE(t.may(second));
  t.wants(second, LockCommand::enter_monitor);
  t.table.remove(first, t.now);
  t.nothing_more();
  t.device_says(ask);
  t.device_says(t.asked(LockCommand::exit_monitor));
  t.device_says(t.asked(LockCommand::enter_monitor));
  t.left(first);
  t.answered(second);
  CHECK(t.may(second));
}
