// Leases of a service that many clients share: transcripts of who asks, when, and what becomes of it.
#include "server/upstream/lease_table.hpp"

#include <catch2/catch.hpp>

using namespace rrgate;
using rr::ErrorCode;
using namespace std::chrono_literals;

namespace {

struct Transcript {
  LeaseTable table;
  rr::TimePoint now{1000s};

  ErrorCode takes(LockClient client, std::string_view path = "s", milliseconds deadman = 300ms,
                  bool takes_over = false) {
    return code(
        table.acquire(client, {Subject::Kind::user, "user" + std::to_string(client)}, path, deadman, takes_over, now));
  }
  ErrorCode renews(LockClient client, std::string_view path = "s") { return code(table.renew(client, path, now)); }
  ErrorCode releases(LockClient client, std::string_view path = "s") { return code(table.release(client, path, now)); }
  ErrorCode commands(LockClient client, std::string_view path = "s", LeaseNeed need = LeaseNeed::covered) {
    return code(table.check(client, path, need, now));
  }
  std::string why_not(LockClient client, std::string_view path = "s", LeaseNeed need = LeaseNeed::covered) {
    const auto allowed = table.check(client, path, need, now);
    REQUIRE_FALSE(allowed.has_value());
    return allowed.error().message;
  }
  void ended(LockClient holder, const std::string& path, const std::string& why) {
    const auto event = table.poll_event();
    REQUIRE(event.has_value());
    CHECK(event->lease.holder == holder);
    CHECK(event->lease.path == path);
    CHECK(event->why == why);
  }
  void nothing_more() { CHECK_FALSE(table.poll_event().has_value()); }

 private:
  static ErrorCode code(const rr::Result<>& result) { return result ? ErrorCode::none : result.error().code; }
};

}  // namespace

TEST_CASE("a lease keeps the commands of others out, at its object and below it") {
  Transcript t;
  CHECK(t.table.is_empty());
  CHECK(t.commands(2) == ErrorCode::none);
  CHECK(t.takes(1, "s.arm") == ErrorCode::none);
  CHECK(t.commands(1, "s.arm") == ErrorCode::none);
  CHECK(t.commands(1, "s.arm.tool[1]") == ErrorCode::none);
  CHECK(t.why_not(2, "s.arm") == "'user1' has the lease of 's.arm'");
  CHECK(t.commands(2, "s.arm.tool[01]") == ErrorCode::object_locked_error);
  CHECK(t.commands(0, "s.arm") == ErrorCode::object_locked_error);
  CHECK(t.commands(2, "s") == ErrorCode::none);
  CHECK(t.commands(2, "s.armature") == ErrorCode::none);
  CHECK(t.takes(2, "s.arm") == ErrorCode::object_locked_error);
  CHECK(t.takes(2, "s") == ErrorCode::object_locked_error);
  CHECK(t.takes(2, "s.arm.tool[1]") == ErrorCode::object_locked_error);
  CHECK(t.takes(1, "s") == ErrorCode::invalid_operation);
  t.nothing_more();
}

TEST_CASE("a lease ends its dead-man's time after the last renewal") {
  Transcript t;
  CHECK(t.takes(1) == ErrorCode::none);
  CHECK(t.table.poll_timeout() == t.now + 300ms);
  for (int i = 0; i < 10; ++i) {
    t.now += 299ms;
    CHECK(t.renews(1) == ErrorCode::none);
  }
  CHECK(t.table.poll_timeout() == t.now + 300ms);
  t.now += 299ms;
  t.table.handle_timeout(t.now);
  t.nothing_more();
  t.now += 1ms;
  t.table.handle_timeout(t.now);
  t.ended(1, "s", "its holder has not renewed it for 300 ms");
  t.nothing_more();
  CHECK(t.table.poll_timeout() == rr::TimePoint::max());
}

TEST_CASE("a timer that is late lets no command pass") {
  Transcript t;
  CHECK(t.takes(1) == ErrorCode::none);
  t.now += 300ms;
  CHECK(t.commands(1) == ErrorCode::object_locked_error);
  t.ended(1, "s", "its holder has not renewed it for 300 ms");
}

TEST_CASE("who has lost a lease commands nothing until he has released it, or has it again") {
  Transcript t;
  CHECK(t.takes(1) == ErrorCode::none);
  t.now += 1s;
  CHECK(t.renews(1) == ErrorCode::invalid_operation);
  CHECK(t.why_not(1, "s.arm") ==
        "the lease of 's' has ended: its holder has not renewed it for 300 ms; release it, or take it again");
  CHECK(t.commands(2) == ErrorCode::none);
  CHECK(t.releases(1) == ErrorCode::none);
  CHECK(t.commands(1) == ErrorCode::none);
  CHECK(t.takes(1) == ErrorCode::none);
  t.now += 1s;
  CHECK(t.commands(1) == ErrorCode::object_locked_error);
  CHECK(t.takes(1) == ErrorCode::none);
  CHECK(t.commands(1) == ErrorCode::none);
}

TEST_CASE("a member that needs a lease is the holder's alone") {
  Transcript t;
  CHECK(t.why_not(1, "s", LeaseNeed::required) == "this needs the lease of 's', which nobody has: take it first");
  CHECK(t.takes(1) == ErrorCode::none);
  CHECK(t.commands(1, "s.arm", LeaseNeed::required) == ErrorCode::none);
  CHECK(t.commands(2, "s.arm", LeaseNeed::required) == ErrorCode::object_locked_error);
  CHECK(t.releases(1) == ErrorCode::none);
  CHECK(t.commands(1, "s", LeaseNeed::required) == ErrorCode::object_locked_error);
}

TEST_CASE("a lease ends by release, by takeover, with its holder, and with the device") {
  Transcript t;
  CHECK(t.releases(1) == ErrorCode::invalid_operation);
  CHECK(t.takes(1) == ErrorCode::none);
  CHECK(t.releases(2) == ErrorCode::invalid_operation);
  CHECK(t.releases(1) == ErrorCode::none);
  t.ended(1, "s", "its holder has released it");

  CHECK(t.takes(1, "s.arm") == ErrorCode::none);
  CHECK(t.takes(2, "s", 300ms, true) == ErrorCode::none);
  t.ended(1, "s.arm", "it was taken over by user2");
  CHECK(t.commands(1, "s.arm") == ErrorCode::object_locked_error);
  CHECK(t.renews(1, "s.arm") == ErrorCode::invalid_operation);
  CHECK(t.commands(2, "s.arm") == ErrorCode::none);

  t.table.handle_gone(2);
  t.ended(2, "s", "the connection of its holder has ended");
  t.table.handle_gone(1);
  CHECK(t.table.is_empty());

  CHECK(t.takes(3) == ErrorCode::none);
  t.table.handle_lost("s", "gone");
  t.ended(3, "s", "gone");
  CHECK(t.takes(3) == ErrorCode::none);
  t.table.handle_lost("the gateway stops");
  t.ended(3, "s", "the gateway stops");
  t.nothing_more();
}

TEST_CASE("locks do not come between a lease and its holder") {
  Transcript t;
  CHECK(t.takes(1, "s.arm") == ErrorCode::none);
  CHECK(t.table.check_lock(1, "s", t.now).has_value());
  CHECK_FALSE(t.table.check_lock(2, "s", t.now).has_value());
  CHECK_FALSE(t.table.check_lock(2, "s.arm.tool", t.now).has_value());
  CHECK(t.table.check_lock(2, "s.camera", t.now).has_value());
}

TEST_CASE("a dead-man's time has bounds, and so has the number of leases") {
  Transcript t;
  CHECK(t.takes(1, "s", 49ms) == ErrorCode::invalid_argument);
  CHECK(t.takes(1, "s", 60'001ms) == ErrorCode::invalid_argument);
  CHECK(t.takes(1, "s", -1ms) == ErrorCode::invalid_argument);
  CHECK(t.takes(1, "s", 50ms) == ErrorCode::none);
  CHECK(t.releases(1) == ErrorCode::none);
  int held = 0;
  const auto takes_all = [&](LockClient client) {
    const auto before = held;
    while (t.takes(client, "s.x[" + std::to_string(held) + "]") == ErrorCode::none) ++held;
    return held - before;
  };
  for (LockClient client = 1; client <= 8; ++client) CHECK(takes_all(client) == 128);
  CHECK(takes_all(9) == 0);
  CHECK(t.takes(1, "s.x[0]", 200ms) == ErrorCode::none);
  CHECK(t.takes(9, "s.x[0]", 300ms, true) == ErrorCode::none);
  CHECK(t.takes(1, "s.x[0]", 300ms, true) == ErrorCode::none);
}

TEST_CASE("who lets leases end and releases none of them has no more, and keeps nobody from theirs") {
  Transcript t;
  int lost = 0;
  for (; t.takes(1, "s.x[" + std::to_string(lost) + "]") == ErrorCode::none; ++lost) t.now += 300ms;
  CHECK(lost == 128);
  CHECK(t.takes(1, "s.x[0]") == ErrorCode::none);  // one of those that it has lost
  CHECK(t.takes(2, "s.y") == ErrorCode::none);
  CHECK(t.takes(2, "s.x[0]", 300ms, true) == ErrorCode::none);
  CHECK(t.releases(1, "s.x[1]") == ErrorCode::none);
  CHECK(t.takes(1, "s.z") == ErrorCode::none);
}
