// What makes a device safe when a lease ends: when it is sent, by which session, and before what.
#include "server/upstream/safe_values.hpp"

#include "server/upstream/lock_path.hpp"
#include "test/server/upstream/counting_device.hpp"

using namespace rrgate;
using namespace rrgate::test;
using namespace std::chrono_literals;

namespace {

/// Everybody is who he says, and may lock; and nobody is nobody.
class Believing final : public rr::Authenticator {
 public:
  rr::Result<rr::AuthenticatedUser> authenticate(const rr::LoginAttempt& attempt) const override {
    return rr::AuthenticatedUser{attempt.username, {"objectlock"}};
  }
};

/// The device has got the call "wait", and refuses it.
void refuse_wait(UpstreamBench& bench, Counting& device, rr::Error why) {
  REQUIRE(bench.run_until([&] { return device.waiting.has_value(); }));
  std::exchange(device.waiting, std::nullopt)->fail(std::move(why));
}

/// As another gateway does that has lost the device.
const rr::Error lost_behind{rr::ErrorCode::connection_error, "connection_lost: device 'arm'"};

/// A device that wants users, the gateway's own session with it, which is that of "gateway", and one of "alice".
struct Guarded {
  Counting device;
  UpstreamBench bench;
  std::shared_ptr<Upstream> own;

  explicit Guarded(const std::string& safe) : bench(service_with_users(device), leases_with(safe)) {
    bench.upstream = std::make_shared<Upstream>(bench.device, "bench", UpstreamLogin{"gateway", {}});
    bench.open();
    own = std::make_shared<Upstream>(bench.device, "bench", UpstreamLogin{"alice", {}}, UpstreamUse::one_client);
    REQUIRE(bench.wait_for(own->open()).has_value());
  }
  ~Guarded() { own->close(); }
  Guarded(const Guarded&) = delete;
  Guarded& operator=(const Guarded&) = delete;

  void lock(const std::shared_ptr<Upstream>& by, HearingClient& holder, rr::LockCommand command) {
    REQUIRE(ask_for_lease(bench, by, holder, command) == rr::ErrorCode::none);
  }
  /// The device has got a safe value, and refuses it because of a lock.
  void refuse_locked() { refuse_wait(bench, device, {rr::ErrorCode::object_locked_error, "Object locked by gateway"}); }

 private:
  static std::shared_ptr<rr::Service> service_with_users(Counting& device) {
    rr::SecurityPolicy policy;
    policy.authenticator = std::make_shared<Believing>();
    policy.require_valid_user = true;
    policy.allow_object_lock = true;
    device.service->set_security(policy);
    return device.service;
  }
};

LeaseConfig leases_with_stop() {
  return leases_with("stop");
}

/// And the lease of the whole service ends: the device has got the call and does not answer it.
void leave_unanswered(UpstreamBench& bench, Counting& device, const std::shared_ptr<Upstream>& upstream,
                      HearingClient& holder) {
  REQUIRE(ask_for_lease(bench, upstream, holder, rr::LockCommand::release_lease) == rr::ErrorCode::none);
  REQUIRE(bench.run_until([&] { return device.waiting.has_value(); }));
}

/// A device that is made safe at its root and below it, by the calls "stop" of both, and who has the lease of all of
/// it.
struct TwoStops {
  Counting device;
  UpstreamBench bench;
  HearingClient holder;

  explicit TwoStops(LeaseConfig leases = leases_with_both())
      : bench(service_with_motor(device), std::move(leases)), holder(bench.upstream) {
    bench.open();
    bench.find("bench.things[1]");
    take_lease(bench, bench.upstream, holder);
  }

  static LeaseConfig leases_with_both() {
    auto leases = leases_with_stop();
    leases.safe.push_back({SafeAction::Kind::call, "bench.things[1]", "stop", "[]"});
    return leases;
  }

 private:
  static std::shared_ptr<rr::Service> service_with_motor(Counting& device) {
    device.put_thing("Motor");
    return device.service;
  }
};

/// The same with a call "wait" of the root before both, and the lease ends: that call is not answered yet.
struct StopsAndWait : TwoStops {
  StopsAndWait() : TwoStops(leases_with_wait()) {
    leave_unanswered(bench, device, bench.upstream, holder);
    count_stops();
  }

  void fail(rr::ErrorCode code) { refuse_wait(bench, device, {code, "not now"}); }
  /// All that were sent before.
  std::size_t count_stops() {
    bench.find("bench.others[1]");
    return device.commands.size();
  }
  void lease_motor(HearingClient& by) {
    REQUIRE(ask_for_lease(bench, bench.upstream, by, rr::LockCommand::acquire_lease, 10s, "bench.things[1]") ==
            rr::ErrorCode::none);
  }

 private:
  static LeaseConfig leases_with_wait() {
    auto leases = leases_with_both();
    leases.safe.insert(leases.safe.begin(), {SafeAction::Kind::call, "bench", "wait", "[]"});
    return leases;
  }
};

}  // namespace

TEST_CASE("what makes safe is held against the object that the device has now") {
  Counting device;
  device.put_thing("Motor");
  LeaseConfig leases;
  leases.is_offered = true;
  leases.safe = {{SafeAction::Kind::call, "bench.things[1]", "stop", "[]"}};
  UpstreamBench bench(device.service, leases);
  bench.open();
  HearingClient client(bench.upstream);
  const auto ask = [&](rr::LockCommand command) { return ask_for_lease(bench, bench.upstream, client, command); };
  // Those that follow come behind the answer of the device to the question what it has now.
  const auto acquire = [&] {
    bench.find("bench.others[1]");
    return ask(rr::LockCommand::acquire_lease);
  };
  const auto replace = [&] {
    const auto before = client.heard.size();
    device.service->root().release("things", "1");
    REQUIRE(bench.run_until([&] { return client.heard.size() > before; }));
  };
  CHECK(acquire() == rr::ErrorCode::none);
  CHECK(ask(rr::LockCommand::release_lease) == rr::ErrorCode::none);
  device.put_thing("Part");
  replace();
  CHECK(acquire() == rr::ErrorCode::invalid_configuration);
  device.put_thing("Motor");
  replace();
  CHECK(acquire() == rr::ErrorCode::none);
  CHECK(ask(rr::LockCommand::release_lease) == rr::ErrorCode::none);
  device.thing.reset();
  replace();
  CHECK(acquire() == rr::ErrorCode::invalid_configuration);
  device.put_thing("Motor");  // of which nobody is told
  CHECK(bench.run_until([&] { return acquire() == rr::ErrorCode::none; }));
}

TEST_CASE("a lease of before its object was released makes safe what the device has there now") {
  Counting device;
  device.put_thing("Motor");
  LeaseConfig leases;
  leases.is_offered = true;
  leases.safe = {{SafeAction::Kind::call, "bench.things[1]", "stop", "[]"}};
  UpstreamBench bench(device.service, leases);
  bench.open();
  HearingClient client(bench.upstream);
  CHECK(bench.run_until([&] {
    return ask_for_lease(bench, bench.upstream, client, rr::LockCommand::acquire_lease) == rr::ErrorCode::none;
  }));
  const auto before = client.heard.size();
  device.thing.reset();
  device.service->root().release("things", "1");
  REQUIRE(bench.run_until([&] { return client.heard.size() > before; }));
  bench.find("bench.others[1]");  // behind the answer of the device that it is not there
  device.put_thing("Motor");
  REQUIRE(ask_for_lease(bench, bench.upstream, client, rr::LockCommand::release_lease) == rr::ErrorCode::none);
  CHECK(bench.run_until([&] { return !device.commands.empty(); }));
}

TEST_CASE("a session is ended behind the answer of what makes the device safe, and that is waited for") {
  Counting device;
  UpstreamBench bench(device.service);
  bench.open();
  bool is_gone = false;
  bool is_safe = false;
  device.service->on_client_gone([&](rr::ClientId) { is_gone = true; });
  const SafeRequest request{SafeAction::Kind::call, "bench", "wait", {}};
  bench.upstream->make_safe(request, [&](const rr::Result<rr::Value>& result) { is_safe = result.has_value(); });
  bench.upstream->close();
  REQUIRE(bench.run_until([&] { return device.waiting.has_value(); }));
  bool has_passed = false;
  boost::asio::steady_timer while_it_waits(bench.io, 100ms);
  while_it_waits.async_wait([&](const auto&) { has_passed = true; });
  REQUIRE(bench.run_until([&] { return has_passed; }));
  CHECK_FALSE(is_gone);
  CHECK(bench.device->is_closing());
  (*device.waiting)();
  REQUIRE(bench.run_until([&] { return is_gone && !bench.device->is_closing(); }));
  CHECK(is_safe);
}

TEST_CASE("a device that does not answer what makes it safe holds the end of a session up for a second alone") {
  Counting device;
  UpstreamBench bench(device.service);
  bench.open();
  bool is_gone = false;
  device.service->on_client_gone([&](rr::ClientId) { is_gone = true; });
  const auto begin = std::chrono::steady_clock::now();
  bench.upstream->make_safe({SafeAction::Kind::call, "bench", "wait", {}}, ignore_result);
  bench.upstream->close();
  REQUIRE(bench.run_until([&] { return is_gone && !bench.device->is_closing(); }));
  CHECK(std::chrono::steady_clock::now() - begin >= 1s);
}

TEST_CASE("what makes a device safe is its last command, whatever a client has sent to a wire before") {
  Counting device;
  UpstreamBench bench(device.service);
  bench.open();
  const auto& wire = *bench.upstream->object_type("bench")->find_member("wish");
  HearingClient client(bench.upstream);
  bench.upstream->join_wire(client, "bench", wire);
  REQUIRE(bench.run_until([&] { return !client.heard.empty(); }));
  const std::vector<rr::Value> much{rr::Value(std::vector<std::uint8_t>(4'000'000))};
  bench.upstream->connection()->call("bench", "take", much, ignore_result);
  REQUIRE(bench.upstream->connection()->session().queued_bytes() > 1'000'000);
  CHECK(bench.upstream->send_wire(client, "bench", wire, rr::Value(100.0)).has_value());
  const std::vector<SafeAction> actions{{SafeAction::Kind::call, "bench", "stop", "[]"}};
  const auto safe = std::make_shared<SafeValues>("device", "bench", actions);
  safe->handle_opened(bench.upstream);
  CHECK(safe->send("bench", bench.upstream, SafeValues::Why::lease_ended));
  const auto before = device.commands.size();
  REQUIRE(bench.run_until([&] { return device.commands.size() >= before + 2; }));
  bench.find("bench");  // whatever else there is has been sent by then
  CHECK(device.commands == std::vector<std::string>{"stop", "stop"});
}

TEST_CASE("what makes safe is known however an index is spelled, and so are rules of leases") {
  const SafeValues safe("device", "s", {{SafeAction::Kind::call, "s.arms[left_arm]", "stop", "[]"}});
  for (const std::string path : {"s.arms[left_arm]", "s.arms[left%5farm]", "s.arms[left%5Farm]"}) {
    CHECK(safe.has(canonical_lock_path(path)));
    for (const std::string rule : {"s.arms[left_arm].stop", "s.arms[left%5farm].stop", "s.arms[*_arm].stop"}) {
      LeaseConfig leases;
      leases.is_offered = true;
      leases.members = {{rule, LeaseNeed::never}};
      CHECK(leases.need_of(path + ".stop") == LeaseNeed::never);
      CHECK(leases.is_urgent("s.arms.left_arm.stop"));
      CHECK(leases.need_of(path + ".go") == LeaseNeed::covered);
    }
  }
}

TEST_CASE("a session that rests is ended behind the answer of what makes the device safe") {
  Counting device;
  UpstreamBench bench(device.service);
  bench.upstream->rest_unused(50ms);
  bench.keep_open({10s, 10s, 10s});
  REQUIRE(bench.wait_for(bench.upstream->opened()).has_value());
  bool is_gone = false;
  device.service->on_client_gone([&](rr::ClientId) { is_gone = true; });
  bench.upstream->make_safe({SafeAction::Kind::call, "bench", "wait", {}}, ignore_result);
  REQUIRE(bench.run_until([&] { return bench.upstream->is_resting() && device.waiting.has_value(); }));
  bool has_passed = false;
  boost::asio::steady_timer while_it_waits(bench.io, 100ms);
  while_it_waits.async_wait([&](const auto&) { has_passed = true; });
  REQUIRE(bench.run_until([&] { return has_passed; }));
  CHECK_FALSE(is_gone);
  (*device.waiting)();
  CHECK(bench.run_until([&] { return is_gone; }));
}

TEST_CASE("a device that was away when a lease ended is made safe when it is back, though nobody uses it any more") {
  Counting device;
  UpstreamBench bench(device.service, leases_with_stop());
  bench.open();
  std::optional<HearingClient> holder(std::in_place, bench.upstream);
  take_lease(bench, bench.upstream, *holder);
  cut(bench, bench.upstream);
  holder.reset();
  bench.upstream->close();
  const std::weak_ptr<Upstream> before = std::exchange(bench.upstream, nullptr);
  REQUIRE(bench.run_until([&] { return before.expired(); }));
  CHECK(device.commands.empty());
  bench.upstream = std::make_shared<Upstream>(bench.device, "bench", UpstreamLogin{});
  bench.open();
  CHECK(bench.run_until([&] { return !device.commands.empty(); }));
}

TEST_CASE("a safe value that a session had not answered when it was lost is sent by the next one") {
  Counting device;
  UpstreamBench bench(device.service, leases_with("wait"));
  const bool is_late = GENERATE(false, true);
  if (is_late) answer_within(bench, 2s);
  bench.open();
  HearingClient holder(bench.upstream);
  take_lease(bench, bench.upstream, holder);
  leave_unanswered(bench, device, bench.upstream, holder);
  auto unanswered = std::exchange(device.waiting, std::nullopt);
  if (is_late) {
    const auto asked = bench.ask(holder, rr::CallKind::function, "bench", "wait");
    REQUIRE(bench.run_until([&] { return asked->has_value(); }));
    CHECK((*asked)->error().code == rr::ErrorCode::request_timeout);
  }
  device.waiting.reset();
  cut(bench, bench.upstream);
  bench.open();
  CHECK(bench.run_until([&] { return device.waiting.has_value(); }));
}

TEST_CASE("a safe value that was lost behind another gateway is sent by the session after the one that it ends") {
  Counting device;
  UpstreamBench bench(device.service, leases_with("wait"));
  bench.open();
  HearingClient holder(bench.upstream);
  take_lease(bench, bench.upstream, holder);
  leave_unanswered(bench, device, bench.upstream, holder);
  const auto asked = bench.ask(holder, rr::CallKind::property_get, "bench", "number");
  refuse_wait(bench, device, lost_behind);
  REQUIRE(bench.run_until([&] { return asked->has_value(); }));
  cut(bench, bench.upstream);
  bench.open();
  CHECK(bench.run_until([&] { return device.waiting.has_value(); }));
}

TEST_CASE("a safe value that another gateway could not pass on is sent again though its session stays open") {
  Counting device;
  UpstreamBench bench(device.service, leases_with("wait"));
  bench.set_retry({10ms, 20ms, 10s});
  bench.open();
  HearingClient holder(bench.upstream);
  take_lease(bench, bench.upstream, holder);
  leave_unanswered(bench, device, bench.upstream, holder);
  const auto locks = bench.device->locks_of("bench");
  const auto refuse = [&] {
    refuse_wait(bench, device, lost_behind);
    REQUIRE(bench.run_until([&] { return locks->is_owing(); }));
  };
  for (int i = 0; i < 3; ++i) refuse();
  SECTION("until it has arrived") {
    REQUIRE(bench.run_until([&] { return device.waiting.has_value(); }));
    (*device.waiting)();
    bench.find("bench.others[1]");
    CHECK_FALSE(locks->is_owing());
  }
  SECTION("but when somebody takes the lease, at once, and then no more") {
    HearingClient next(bench.upstream);
    take_lease(bench, bench.upstream, next);
    refuse();
    REQUIRE(bench.run_until([&] { return !locks->is_owing(); }));
    bench.find("bench.others[1]");
    CHECK_FALSE(device.waiting);
  }
}

TEST_CASE("a safe value that waits to be sent again is sent at once by another session when its own is closed") {
  Counting device;
  UpstreamBench bench(device.service, leases_with("wait"));
  bench.set_retry({1h, 1h, 10s});
  bench.open();
  const auto own = std::make_shared<Upstream>(bench.device, "bench", UpstreamLogin{}, UpstreamUse::one_client);
  REQUIRE(bench.wait_for(own->open()).has_value());
  const auto locks = bench.device->locks_of("bench");
  {
    HearingClient holder(own);
    take_lease(bench, own, holder);
    leave_unanswered(bench, device, own, holder);
  }
  refuse_wait(bench, device, lost_behind);
  REQUIRE(bench.run_until([&] { return locks->is_owing(); }));
  own->close();
  REQUIRE(bench.run_until([&] { return device.waiting.has_value(); }));
  (*device.waiting)();
  bench.find("bench.others[1]");
  CHECK_FALSE(locks->is_owing());
}

TEST_CASE("a safe value that a lock keeps out is sent again though another session is refused for its own reasons") {
  Counting device;
  UpstreamBench bench(device.service, leases_with("wait"));
  bench.set_retry({1h, 1h, 10s});
  bench.open();
  HearingClient holder(bench.upstream);
  take_lease(bench, bench.upstream, holder);
  leave_unanswered(bench, device, bench.upstream, holder);
  const auto locks = bench.device->locks_of("bench");
  const auto refuse = [&](rr::ErrorCode code) {
    refuse_wait(bench, device, {code, "not by you"});
    bench.find("bench.others[1]");
  };
  refuse(rr::ErrorCode::object_locked_error);
  const auto own = std::make_shared<Upstream>(bench.device, "bench", UpstreamLogin{}, UpstreamUse::one_client);
  REQUIRE(bench.wait_for(own->open()).has_value());
  refuse(rr::ErrorCode::permission_denied);
  CHECK(locks->is_owing());
  HearingClient next(bench.upstream);
  take_lease(bench, bench.upstream, next);
  refuse(rr::ErrorCode::permission_denied);  // by the session that the lock kept out
  CHECK_FALSE(locks->is_owing());
  own->close();
}

TEST_CASE("a safe value that is refused above another's lease is sent again without those that were taken") {
  StopsAndWait made;
  auto& [device, bench, holder] = static_cast<TwoStops&>(made);
  bench.set_retry({10ms, 20ms, 10s});
  HearingClient next(bench.upstream);
  made.lease_motor(next);
  const auto before = made.count_stops();
  for (int i = 0; i < 3; ++i) made.fail(rr::ErrorCode::object_locked_error);
  REQUIRE(bench.run_until([&] { return device.waiting.has_value(); }));
  CHECK(made.count_stops() == before);
}

TEST_CASE("a new lease first sends what was refused at, above and below its object") {
  StopsAndWait made;
  auto& [device, bench, holder] = static_cast<TwoStops&>(made);
  bench.set_retry({1h, 1h, 10s});
  made.fail(rr::ErrorCode::object_locked_error);
  const auto before = made.count_stops();
  CHECK_FALSE(device.waiting);
  HearingClient next(bench.upstream);
  if (GENERATE(false, true))
    made.lease_motor(next);
  else
    take_lease(bench, bench.upstream, next);
  REQUIRE(bench.run_until([&] { return device.waiting.has_value(); }));
  CHECK(made.count_stops() == before);
}

TEST_CASE("a safe value that a lost session has not answered is sent by one that is open, but into no other lease") {
  Counting device;
  UpstreamBench bench(device.service, leases_with("wait"));
  bench.open();
  const auto own = std::make_shared<Upstream>(bench.device, "bench", UpstreamLogin{}, UpstreamUse::one_client);
  REQUIRE(bench.wait_for(own->open()).has_value());
  HearingClient holder(own);
  HearingClient next(bench.upstream);
  take_lease(bench, own, holder);
  leave_unanswered(bench, device, own, holder);
  const bool is_leased = GENERATE(false, true);
  if (is_leased) take_lease(bench, bench.upstream, next);
  device.waiting.reset();
  cut(bench, own);
  if (!is_leased) CHECK(bench.run_until([&] { return device.waiting.has_value(); }));
  const auto asked = bench.ask(next, rr::CallKind::property_get, "bench", "number");
  REQUIRE(bench.run_until([&] { return asked->has_value(); }));  // what was sent before has arrived by then
  CHECK(device.waiting.has_value() == !is_leased);
  own->close();
}

TEST_CASE("a safe value that is in doubt when its session is closed is sent by one that is open") {
  Counting device;
  UpstreamBench bench(device.service, leases_with("wait"));
  bench.open();
  answer_within(bench, 2s);
  const auto own = std::make_shared<Upstream>(bench.device, "bench", UpstreamLogin{}, UpstreamUse::one_client);
  REQUIRE(bench.wait_for(own->open()).has_value());
  const auto locks = bench.device->locks_of("bench");
  std::optional<rr::Reply<void>> unanswered;
  {
    HearingClient holder(own);
    take_lease(bench, own, holder);
    leave_unanswered(bench, device, own, holder);
    unanswered = std::exchange(device.waiting, std::nullopt);
    const auto asked = bench.ask_by(*own, holder, rr::CallKind::function, "bench", "wait");
    REQUIRE(bench.run_until([&] { return asked->has_value(); }));
    CHECK((*asked)->error().code == rr::ErrorCode::request_timeout);
  }
  CHECK(locks->is_owing());  // a session that would rest stays open
  device.waiting.reset();
  own->close();
  REQUIRE(bench.run_until([&] { return device.waiting.has_value(); }));
  (*device.waiting)();
  CHECK(bench.run_until([&] { return !locks->is_owing(); }));
}

TEST_CASE("a safe value that is refused because of a lock of a lost session is sent again behind the unlocking") {
  Guarded made("wait");
  auto& [device, bench, own] = made;
  HearingClient holder(bench.upstream);
  bench.set_retry({1h, 1h, 10s});
  made.lock(bench.upstream, holder, rr::LockCommand::lock_for_client);
  take_lease(bench, bench.upstream, holder);
  cut(bench, bench.upstream);
  bench.open();
  made.refuse_locked();
  bench.find("bench.others[1]");  // behind the refusal
  CHECK_FALSE(device.waiting);
  made.lock(bench.upstream, holder, rr::LockCommand::unlock);
  CHECK(bench.run_until([&] { return device.waiting.has_value(); }));
}

TEST_CASE("a safe value that the lock of a user's lost session keeps out is sent by the session that follows") {
  Guarded made("stop");
  auto& [device, bench, own] = made;
  bench.set_retry({1h, 1h, 10s});
  const auto other =  // of the same user: the device does not forget the lock with the first
      std::make_shared<Upstream>(bench.device, "bench", UpstreamLogin{"alice", {}}, UpstreamUse::one_client);
  REQUIRE(bench.wait_for(other->open()).has_value());
  HearingClient holder(own);
  made.lock(own, holder, rr::LockCommand::lock_for_user);
  take_lease(bench, own, holder);
  cut(bench, own);
  bench.find("bench.others[1]");  // behind the answer to the safe value
  CHECK(device.commands.empty());
  REQUIRE(bench.wait_for(own->open()).has_value());
  CHECK(bench.run_until([&] { return !device.commands.empty(); }));
  other->close();
}

TEST_CASE("a safe value that is refused because of somebody's lock is sent when a session is opened") {
  Guarded made("wait");
  auto& [device, bench, own] = made;
  bench.set_retry({1h, 1h, 10s});
  HearingClient holder(bench.upstream);
  take_lease(bench, bench.upstream, holder);
  REQUIRE(ask_for_lease(bench, bench.upstream, holder, rr::LockCommand::release_lease) == rr::ErrorCode::none);
  made.refuse_locked();
  bench.find("bench.others[1]");  // behind the refusal
  cut(bench, own);
  REQUIRE(bench.wait_for(own->open()).has_value());
  CHECK(bench.run_until([&] { return device.waiting.has_value(); }));
}

TEST_CASE("a stop that a lock keeps out is sent by the session that has the lock, and told when that is answered") {
  Guarded made("stop");
  auto& [device, bench, own] = made;
  HearingClient holder(own);
  made.lock(own, holder, rr::LockCommand::lock_for_user);
  std::optional<rr::Result<>> stopped;
  bench.upstream->stop_object("bench", [&](const rr::Result<>& result) { stopped = result; });
  REQUIRE(bench.run_until([&] { return stopped.has_value(); }));
  CHECK(stopped->has_value());
  CHECK(device.commands == std::vector<std::string>{"stop"});
}

TEST_CASE("a stop that needs no lock is sent by the session that is asked, whoever has locked the object") {
  Guarded made("halt");
  auto& [device, bench, own] = made;
  HearingClient holder(own);
  made.lock(own, holder, rr::LockCommand::lock_for_user);
  bench.upstream->stop_object("bench", [](const rr::Result<>&) {});
  REQUIRE(bench.run_until([&] { return device.waiting.has_value(); }));
  CHECK(device.waiting->caller().user == "gateway");
}

TEST_CASE("a stop that the device does not take has failed") {
  Counting device;
  UpstreamBench bench(device.service, leases_with("wait"));
  bench.open();
  std::optional<rr::Result<>> stopped;
  bench.upstream->stop_object("bench", [&](const rr::Result<>& result) { stopped = result; });
  REQUIRE(bench.run_until([&] { return device.waiting.has_value(); }));
  CHECK_FALSE(stopped);
  device.waiting->fail({rr::ErrorCode::operation_failed, "the brake is stuck"});
  REQUIRE(bench.run_until([&] { return stopped.has_value(); }));
  CHECK(stopped->error().message == "the brake is stuck");
}

TEST_CASE("a safe value that fits no more holds up no other that is owed") {
  TwoStops made;
  auto& [device, bench, holder] = made;
  HearingClient other(bench.upstream);
  device.put_thing("Part");
  device.service->root().release("things", "1");
  REQUIRE(bench.run_until([&] {
    return ask_for_lease(bench, bench.upstream, other, rr::LockCommand::acquire_lease) ==
           rr::ErrorCode::invalid_configuration;
  }));
  cut(bench, bench.upstream);
  bench.open();
  CHECK(bench.run_until([&] { return !device.commands.empty(); }));
}

TEST_CASE("what is owed to a device is sent before the commands of a new holder") {
  TwoStops made;
  auto& [device, bench, holder] = made;
  cut(bench, bench.upstream);
  bench.open();  // and its objects are looked for still
  take_lease(bench, bench.upstream, holder);
  const auto sent = bench.ask(holder, rr::CallKind::poke_out, "bench", "wish", 0, {rr::Value(1.0)});
  REQUIRE(bench.run_until([&] { return sent->has_value(); }));
  CHECK((*sent)->has_value());
  CHECK(device.commands.front() == "stop");
}

TEST_CASE("a lease ends when its holder may command no more, but not where it was taken to keep others out") {
  Counting device;
  UpstreamBench bench(device.service, leases_with_stop());
  bench.open();
  HearingClient holder(bench.upstream);
  holder.can_command = false;
  const auto locks = bench.device->locks_of("bench");
  take_lease(bench, bench.upstream, holder);
  bench.upstream->review_locks(holder);
  REQUIRE(locks->leases().size() == 1);
  holder.can_command = true;
  take_lease(bench, bench.upstream, holder);  // again
  bench.upstream->review_locks(holder);
  REQUIRE(locks->leases().size() == 1);
  holder.can_command = false;
  take_lease(bench, bench.upstream, holder);
  CHECK(locks->leases().size() == 1);
  bench.upstream->review_locks(holder);
  CHECK(locks->leases().empty());
}

TEST_CASE("a session that rests is opened to make the device safe") {
  Counting device;
  UpstreamBench bench(device.service, leases_with_stop());
  bench.upstream->rest_unused(50ms);
  bench.keep_open({10ms, 20ms, 10s});
  REQUIRE(bench.run_until([&] { return bench.upstream->is_open(); }));
  const auto own = std::make_shared<Upstream>(bench.device, "bench", UpstreamLogin{}, UpstreamUse::one_client);
  REQUIRE(bench.wait_for(own->open()).has_value());
  HearingClient holder(own);
  take_lease(bench, own, holder);
  REQUIRE(bench.run_until([&] { return bench.upstream->is_resting(); }));
  cut(bench, own);
  CHECK(bench.run_until([&] { return !device.commands.empty(); }));
  CHECK(bench.run_until([&] { return bench.upstream->is_resting(); }));  // and no longer than that
  own->close();
}

TEST_CASE("a session of nobody's makes nothing safe where the device wants users") {
  Counting device;
  rr::SecurityPolicy policy;
  policy.authenticator = std::make_shared<Believing>();
  policy.require_valid_user = true;
  device.service->set_security(policy);
  UpstreamBench bench(device.service, leases_with_stop());
  bench.open();
  REQUIRE(bench.upstream->requires_user());
  const auto own =
      std::make_shared<Upstream>(bench.device, "bench", UpstreamLogin{"alice", {}}, UpstreamUse::one_client);
  REQUIRE(bench.wait_for(own->open()).has_value());
  HearingClient holder(own);
  take_lease(bench, own, holder);
  cut(bench, own);
  REQUIRE(bench.upstream->is_open());
  CHECK(device.commands.empty());
  REQUIRE(bench.wait_for(own->open()).has_value());
  CHECK(bench.run_until([&] { return !device.commands.empty(); }));
  own->close();
}
