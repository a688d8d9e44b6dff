// Locks of a service that many clients share.
#include "server/upstream/lock_path.hpp"
#include "test/server/upstream/lock_transcript.hpp"

using namespace rrgate;
using namespace rrgate::test;
using rr::ErrorCode;
using rr::LockCommand;

namespace {

const std::initializer_list<LockCommand> any_lock = {LockCommand::lock_for_user, LockCommand::lock_for_client};

}  // namespace

TEST_CASE("clients that share a session are kept from an object by the lock of one of them") {
  for (const auto command : any_lock) {
    Transcript t;
    const auto holder = t.shares(1), other = t.shares(2);
    CHECK(t.may(other));
    t.takes(holder, command);
    CHECK(t.may(holder));
    CHECK(t.may(holder, "s.tool"));
    CHECK(t.use(other) == ErrorCode::object_locked_error);
    CHECK(t.use(other, "s.tool") == ErrorCode::object_locked_error);
    CHECK(t.may(other, "s", true));
    t.wants(holder, LockCommand::unlock);
    t.device_says(t.asked(LockCommand::unlock));
    t.answered(holder);
    CHECK(t.may(other));
    t.nothing_more();
  }
}

TEST_CASE("others are kept out from the moment in which the device is asked") {
  Transcript t;
  const auto holder = t.shares(1), other = t.shares(2);
  t.wants(holder, LockCommand::lock_for_client);
  CHECK_FALSE(t.may(other));
  t.device_says(t.asked(LockCommand::lock_for_client), ErrorCode::object_locked_error);
  t.answered(holder, ErrorCode::object_locked_error);
  CHECK(t.may(other));
  CHECK(t.may(holder));
}

TEST_CASE("what is held is told, and as whom it was taken") {
  Transcript t;
  const auto alice = t.shares(1, "alice"), nobody = t.shares(2);
  CHECK(t.table.held().empty());
  t.takes(alice, LockCommand::lock_for_user, shared, "s.a[01]");
  t.takes(nobody, LockCommand::lock_for_client, shared, "s.b");
  t.wants(nobody, LockCommand::enter_monitor, "s");
  t.device_says(t.asked(LockCommand::enter_monitor));
  t.answered(nobody);
  const Subject as_alice{Subject::Kind::user, "alice"};
  CHECK(t.table.held() == std::vector<HeldLock>{{HeldLock::Kind::user, "s.a[1]", as_alice},
                                                {HeldLock::Kind::client, "s.b", {}},
                                                {HeldLock::Kind::monitor, "s", {}}});
  t.table.remove(nobody, t.now);  // the device is to take back what nobody holds
  CHECK(t.table.held() == std::vector<HeldLock>{{HeldLock::Kind::user, "s.a[1]", as_alice}});
}

TEST_CASE("locks do not overlap") {
  Transcript t;
  const auto holder = t.shares(1), other = t.shares(2);
  t.takes(holder, LockCommand::lock_for_client, shared, "s.a");
  for (const auto client : {holder, other})
    for (const auto* path : {"s", "s.a", "s.a.b"}) {
      t.wants(client, LockCommand::lock_for_client, path);
      t.answered(client, ErrorCode::object_locked_error);
    }
  t.takes(other, LockCommand::lock_for_client, shared, "s.ab");
  CHECK(t.may(other, "s"));
  t.wants(holder, LockCommand::unlock, "s.a.b");  // inherited
  t.answered(holder, ErrorCode::object_locked_error);
}

TEST_CASE("an object has one lock however its path is written") {
  CHECK(canonical_lock_path("s.tools[1]") == "s.tools[1]");
  for (const auto* path : {"s.tools[01]", "s.tools[%2b1]", "s.tools[%2B001]"})
    CHECK(canonical_lock_path(path) == "s.tools[1]");
  CHECK(canonical_lock_path("s.tools[-01].x") == canonical_lock_path("s.tools[-1].x"));
  for (const auto* path : {"s.tools[0]", "s.tools[00]", "s.tools[-0]"})
    CHECK(canonical_lock_path(path) == "s.tools[0]");
  CHECK(canonical_lock_path("s.tools[%2b]") == "s.tools[%2b]");
  CHECK(canonical_lock_path("s.tools[10]") != canonical_lock_path("s.tools[1]"));
  CHECK(canonical_lock_path("s.named[a%2Eb]") == canonical_lock_path("s.named[a%2eb]"));
  Transcript t;
  const auto holder = t.shares(1), other = t.shares(2);
  t.takes(holder, LockCommand::lock_for_client, shared, "s.tools[%2b1]");
  CHECK_FALSE(t.may(other, "s.tools[1]"));
  CHECK_FALSE(t.may(other, "s.tools[01].tip"));
  CHECK(t.may(other, "s.tools[10]"));
}

TEST_CASE("only the holder unlocks, and unlocking nothing is no error") {
  Transcript t;
  const auto holder = t.shares(1), other = t.shares(2);
  t.wants(other, LockCommand::unlock);
  t.answered(other);
  t.takes(holder, LockCommand::lock_for_client);
  t.wants(other, LockCommand::unlock);
  t.answered(other, ErrorCode::object_locked_error);
  CHECK_FALSE(t.may(other));
  t.nothing_more();
}

TEST_CASE("a user's lock is for all clients of his, and lasts as long as one of them") {
  Transcript t;
  const auto alice = t.shares(1, "alice"), again = t.shares(2, "alice"), bob = t.shares(3, "bob"), nobody = t.shares(4);
  t.takes(alice, LockCommand::lock_for_user);
  CHECK(t.may(again));
  CHECK_FALSE(t.may(bob));
  CHECK_FALSE(t.may(nobody));
  t.table.remove(alice, t.now);
  t.left(alice);
  CHECK(t.may(again));
  CHECK_FALSE(t.may(bob));
  t.table.remove(again, t.now);
  t.device_says(t.asked(LockCommand::unlock));
  t.left(again);
  CHECK(t.may(bob));
}

TEST_CASE("a user of the gateway and one of the device share a name, not their locks") {
  Transcript t;
  const auto here = t.shares(1, "alice"), there = t.has_own(2, "alice", alices);
  t.takes(here, LockCommand::lock_for_user);
  CHECK(t.may(here));
  CHECK_FALSE(t.may(there));
}

TEST_CASE("a user's lock is left to no client whom the device would refuse it") {
  Transcript t;
  const LockClient socket = 1;
  t.table.add(socket, {Subject{Subject::Kind::device_user, "bob"}, alices, false});
  t.has_own(2, "bob", alices_other);
  t.wants(socket, LockCommand::lock_for_user);
  t.device_says(t.asked(LockCommand::lock_for_client, alices));
  t.answered(socket);
  t.table.remove(socket, t.now);
  t.device_says(t.asked(LockCommand::unlock, alices));
  t.left(socket);
  CHECK(t.table.held().empty());
}

TEST_CASE("a client's lock is for no other client of its user") {
  Transcript t;
  const auto alice = t.shares(1, "alice"), again = t.shares(2, "alice");
  t.takes(alice, LockCommand::lock_for_client);
  CHECK_FALSE(t.may(again));
  t.wants(again, LockCommand::unlock);  // but one user may unlock it
  t.device_says(t.asked(LockCommand::unlock));
  t.answered(again);
  CHECK(t.may(again));
}

TEST_CASE("a client that leaves is told so once its locks are given back") {
  Transcript t;
  const auto holder = t.shares(1), other = t.shares(2);
  SECTION("held") {
    t.takes(holder, LockCommand::lock_for_client, shared, "s.a");
    t.takes(holder, LockCommand::lock_for_client, shared, "s.b");
    t.table.remove(holder, t.now);
    const auto first = t.asked(LockCommand::unlock, shared, "s.a");
    const auto second = t.asked(LockCommand::unlock, shared, "s.b");
    t.device_says(first);
    t.nothing_more();
    t.device_says(second);
    t.left(holder);
  }
  SECTION("asked for") {
    t.wants(holder, LockCommand::lock_for_client, "s.a");
    const auto ask = t.asked(LockCommand::lock_for_client, shared, "s.a");
    t.table.remove(holder, t.now);
    t.nothing_more();
    t.device_says(ask);
    t.answered(holder);
    t.device_says(t.asked(LockCommand::unlock, shared, "s.a"));
    t.left(holder);
  }
  SECTION("being unlocked") {
    t.takes(holder, LockCommand::lock_for_client, shared, "s.a");
    t.wants(holder, LockCommand::unlock, "s.a");
    const auto ask = t.asked(LockCommand::unlock, shared, "s.a");
    t.table.remove(holder, t.now);
    t.nothing_more();
    t.device_says(ask);
    t.answered(holder);
    t.left(holder);
  }
  SECTION("nothing") {
    t.table.remove(holder, t.now);
    t.left(holder);
  }
  t.takes(other, LockCommand::lock_for_client, shared, "s");
}

TEST_CASE("a holder whose lock was lost with the device is refused until he knows it") {
  Transcript t;
  const auto holder = t.shares(1), other = t.shares(2);
  t.takes(holder, LockCommand::lock_for_client);
  t.table.handle_lost(shared, t.now);
  CHECK(t.use(holder) == ErrorCode::object_locked_error);
  CHECK(t.use(holder, "s.tool") == ErrorCode::object_locked_error);
  CHECK(t.may(holder, "s", true));
  CHECK(t.may(other));
  SECTION("he locks it again") {
    t.takes(holder, LockCommand::lock_for_client);
    CHECK(t.may(holder));
    CHECK_FALSE(t.may(other));
  }
  SECTION("he unlocks it, at the device too, which may have kept it") {
    t.wants(holder, LockCommand::unlock);
    t.device_says(t.asked(LockCommand::unlock));
    t.answered(holder);
    CHECK(t.may(holder));
    CHECK(t.may(other));
  }
  SECTION("another one was quicker") {
    t.takes(other, LockCommand::lock_for_client);
    CHECK(t.may(other));
    t.wants(holder, LockCommand::lock_for_client);
    t.answered(holder, ErrorCode::object_locked_error);
    CHECK_FALSE(t.may(holder));
    t.wants(holder, LockCommand::unlock);
    t.answered(holder, ErrorCode::object_locked_error);
    CHECK(t.may(other));
  }
}

TEST_CASE("a lock that the device gives while its session ends is nobody's") {
  Transcript t;
  const auto holder = t.shares(1), other = t.shares(2);
  t.wants(holder, LockCommand::lock_for_client);
  const auto ask = t.asked(LockCommand::lock_for_client);
  t.table.handle_lost(shared, t.now);
  t.device_says(ask, ErrorCode::connection_error);
  t.answered(holder, ErrorCode::connection_error);
  CHECK(t.may(other));
  CHECK(t.may(holder));
}

TEST_CASE("a lock that the device may have given without saying so is taken back") {
  Transcript t;
  const auto holder = t.shares(1), other = t.shares(2);
  t.wants(holder, LockCommand::lock_for_client);
  t.device_says(t.asked(LockCommand::lock_for_client), ErrorCode::request_timeout);
  t.answered(holder, ErrorCode::request_timeout);
  const auto back = t.asked(LockCommand::unlock);
  t.wants(other, LockCommand::lock_for_client);
  t.answered(other, ErrorCode::object_locked_error);
  SECTION("it says that it is free") {
    t.device_says(back);
  }
  SECTION("it says nothing: the session ends") {
    t.device_says(back, ErrorCode::request_timeout);
    CHECK(t.next<LockSessionInDoubt>().session == shared);
  }
  t.takes(other, LockCommand::lock_for_client);
}

TEST_CASE("clients with sessions of their own lock as the users that they are at the device") {
  Transcript t;
  const auto alice = t.has_own(1, "alice", alices), again = t.has_own(2, "alice", alices_other);
  const auto root = t.has_own(3, "root", roots), nobody = t.shares(4);
  SECTION("a user's lock") {
    t.takes(alice, LockCommand::lock_for_user, alices);
    CHECK(t.may(again));
    CHECK_FALSE(t.may(root));
    CHECK_FALSE(t.may(nobody));
    t.table.remove(alice, t.now);
    t.left(alice);  // its session ends, the lock stays with the other
    CHECK(t.may(again));
    CHECK_FALSE(t.may(root));
    t.table.remove(again, t.now);
    t.left(again);
    CHECK(t.may(root));
  }
  SECTION("a client's lock ends with its session") {
    t.takes(alice, LockCommand::lock_for_client, alices);
    CHECK_FALSE(t.may(again));
    t.table.remove(alice, t.now);
    t.left(alice);
    CHECK(t.may(again));
  }
  SECTION("a restart of the device is heard of by one session after the other") {
    t.takes(alice, LockCommand::lock_for_user, alices);
    t.table.handle_lost(alices_other, t.now);
    CHECK(t.use(alice) == ErrorCode::object_locked_error);
    CHECK(t.use(again) == ErrorCode::object_locked_error);
    CHECK(t.may(nobody));
  }
  SECTION("the device says who may release another user's lock") {
    t.takes(alice, LockCommand::lock_for_client, alices);
    t.wants(root, LockCommand::unlock);
    const auto ask = t.asked(LockCommand::unlock, roots);
    CHECK(t.may(alice));
    SECTION("not he") {
      t.device_says(ask, ErrorCode::object_locked_error);
      t.answered(root, ErrorCode::object_locked_error);
      CHECK(t.may(alice));
      CHECK_FALSE(t.may(root));
    }
    SECTION("he may: the holder hears of it") {
      t.device_says(ask);
      t.answered(root);
      CHECK(t.use(alice) == ErrorCode::object_locked_error);
      CHECK(t.may(root));
      t.takes(alice, LockCommand::lock_for_client, alices);
      CHECK(t.may(alice));
    }
    SECTION("the holder leaves meanwhile") {
      t.table.remove(alice, t.now);
      t.device_says(ask, ErrorCode::object_locked_error);
      t.answered(root, ErrorCode::object_locked_error);
      t.device_says(t.asked(LockCommand::unlock, alices), ErrorCode::connection_error);
      t.left(alice);
      CHECK(t.may(root));
    }
    SECTION("the holder's session is lost meanwhile") {
      t.table.handle_lost(alices, t.now);
      CHECK_FALSE(t.may(alice));
      t.device_says(ask, ErrorCode::object_locked_error);
      t.answered(root, ErrorCode::object_locked_error);
      CHECK_FALSE(t.may(alice));
      CHECK(t.may(root));
    }
  }
  SECTION("a lock that nobody here holds is the device's affair") {
    t.wants(root, LockCommand::unlock);
    t.device_says(t.asked(LockCommand::unlock, roots), ErrorCode::object_locked_error);
    t.answered(root, ErrorCode::object_locked_error);
    CHECK(t.may(root));
  }
}

TEST_CASE("a lock ends with its object") {
  Transcript t;
  const auto holder = t.shares(1), other = t.shares(2);
  t.takes(holder, LockCommand::lock_for_client, shared, "s.a.b");
  t.table.handle_released("s.a", t.now);
  CHECK_FALSE(t.may(holder, "s.a.b"));
  CHECK(t.may(other, "s.a.b"));
  t.device_says(t.asked(LockCommand::unlock, shared, "s.a.b"), ErrorCode::object_not_found);
  t.nothing_more();
  t.takes(other, LockCommand::lock_for_client, shared, "s.a.b");
}

TEST_CASE("it is known whether another client has locked something below an object") {
  Transcript t;
  const auto one = t.shares(1);
  const auto other = t.shares(2, "alice");
  const auto hers = t.shares(3, "alice");
  const auto is_free = [&](LockClient client, std::string_view path = "s") {
    return t.table.check_below(client, path).has_value();
  };
  t.takes(other, LockCommand::lock_for_user, shared, "s.arm");
  CHECK_FALSE(is_free(one));
  CHECK(is_free(one, "s.arm"));
  CHECK(is_free(one, "s.a"));
  CHECK(is_free(other));
  CHECK(is_free(hers));
  t.wants(other, LockCommand::unlock, "s.arm");
  CHECK_FALSE(is_free(one));
  t.device_says(t.asked(LockCommand::unlock, shared, "s.arm"));
  t.answered(other);
  CHECK(is_free(one));
  t.wants(other, LockCommand::enter_monitor, "s.tools[01]");
  CHECK_FALSE(is_free(one));
  CHECK(is_free(other));
  CHECK_FALSE(is_free(hers));
}

TEST_CASE("who may not lock any more has given back what it had, and is told so until it unlocks") {
  Transcript t;
  const auto one = t.shares(1);
  const auto other = t.shares(2);
  t.takes(one, LockCommand::lock_for_client, shared, "s.arm");
  t.wants(one, LockCommand::enter_monitor, "s");
  t.device_says(t.asked(LockCommand::enter_monitor));
  t.answered(one);
  t.wants(other, LockCommand::enter_monitor);
  CHECK(t.table.paths_of(one) == std::vector<std::string>{"s.arm", "s"});
  CHECK(t.table.paths_of(other) == std::vector<std::string>{"s"});
  CHECK(t.table.has_at(one, "s.arm"));
  CHECK_FALSE(t.table.has_at(other, "s.arm"));

  for (const auto& path : t.table.paths_of(one)) t.table.handle_right_lost(one, path, t.now);
  t.device_says(t.asked(LockCommand::unlock, shared, "s.arm"));
  t.device_says(t.asked(LockCommand::exit_monitor));
  t.device_says(t.asked(LockCommand::enter_monitor));
  t.answered(other);
  CHECK(t.may(other, "s.arm"));
  CHECK(t.use(one, "s.arm") == ErrorCode::object_locked_error);
  CHECK(t.table.has_at(one, "s.arm"));
  t.wants(one, LockCommand::exit_monitor);
  t.answered(one);
  t.wants(one, LockCommand::unlock, "s.arm");
  t.device_says(t.asked(LockCommand::unlock, shared, "s.arm"));
  t.answered(one);
  CHECK(t.may(one, "s.arm"));
  CHECK_FALSE(t.table.has_at(one, "s.arm"));
  t.nothing_more();
}

TEST_CASE("it is known by which session an object is locked") {
  Transcript t;
  const auto alice = t.has_own(2, "alice", alices);
  CHECK_FALSE(t.table.locked_by("s.arm"));
  t.takes(alice, LockCommand::lock_for_user, alices, "s.arm");
  CHECK(t.table.locked_by("s.arm") == alices);
  CHECK(t.table.locked_by("s.arm.hand") == alices);
  CHECK_FALSE(t.table.locked_by("s"));
  t.table.handle_lost(alices, t.now);
  CHECK_FALSE(t.table.locked_by("s.arm"));
}

TEST_CASE("a right to lock that is lost while the device is asked leaves nothing behind") {
  Transcript t;
  const auto one = t.shares(1);
  const auto other = t.shares(2);
  t.wants(one, LockCommand::lock_for_client);
  const auto lock = t.asked(LockCommand::lock_for_client);
  t.table.handle_right_lost(one, "s", t.now);
  t.answered(one, ErrorCode::permission_denied);
  t.device_says(lock);
  t.device_says(t.asked(LockCommand::unlock));
  CHECK(t.may(other));
  t.wants(one, LockCommand::enter_monitor, "s.arm");
  const auto enter = t.asked(LockCommand::enter_monitor, shared, "s.arm");
  t.wants(other, LockCommand::enter_monitor, "s.arm");
  t.table.handle_right_lost(other, "s.arm", t.now);
  t.answered(other, ErrorCode::permission_denied);
  t.table.handle_right_lost(one, "s.arm", t.now);
  t.answered(one, ErrorCode::permission_denied);
  t.device_says(enter);
  t.device_says(t.asked(LockCommand::exit_monitor, shared, "s.arm"));
  CHECK(t.may(other, "s.arm"));
  t.nothing_more();
}
