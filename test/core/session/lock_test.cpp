// Object locks and monitor locks between several clients of one service.
#include <catch2/catch.hpp>

#include "test/core/session/loopback.hpp"
#include "test/support/print.hpp"

using namespace rr;
using namespace rr::test;

namespace {

class NobodysAuthenticator final : public Authenticator {
 public:
  Result<AuthenticatedUser> authenticate(const LoginAttempt&) const override {
    return make_error(ErrorCode::internal_error, "not to be asked");
  }
};

/// Several clients of the service `arm`, each with its own connection. Locks that change are told to all.
class Clients {
 public:
  explicit Clients(bool allow_object_lock = true) {
    SecurityPolicy policy;
    policy.authenticator = std::make_shared<NobodysAuthenticator>();
    policy.allow_object_lock = allow_object_lock;
    home_.directory.find("arm")->set_policy(policy);
  }

  struct Client {
    std::unique_ptr<ClientSession> client;
    std::unique_ptr<ServiceSession> service;
    std::map<RequestId, Result<Value>> done;
    bool is_closed = false;
  };

  /// `user` empty: without login.
  Client& add(const std::string& user, std::vector<std::string> privileges = {"objectlock"}) {
    auto& added = *clients_.emplace_back(std::make_unique<Client>());
    ClientOptions options;
    options.connection.self = {client_id, "test.client"};
    options.service = "arm";
    added.client = std::make_unique<ClientSession>(options, home_.now);
    added.service = std::make_unique<ServiceSession>(home_.directory, ServiceSessionOptions{}, home_.now);
    pump();
    if (user.empty()) return added;
    const auto id = added.client->authenticate(user, Value(MapString{}), home_.now);
    privileges_ = std::move(privileges);
    CHECK(ask(added, id));
    return added;
  }

  /// Everything that can happen without time passing.
  void pump() {
    bool is_busy = true;
    while (is_busy) {
      is_busy = false;
      for (auto& each : clients_) {
        while (home_.carry(*each->client, *each->service, 1 << 20) ||
               home_.carry(*each->service, *each->client, 1 << 20))
          is_busy = true;
        while (auto event = each->service->poll_event()) is_busy = handle(*each, *event);
        while (auto event = each->client->poll_event()) {
          if (auto* completed = std::get_if<Completed>(&*event)) {
            CHECK_FALSE(each->done.contains(completed->id));
            each->done.emplace(completed->id, std::move(completed->result));
          }
          if (std::holds_alternative<SessionClosed>(*event)) each->is_closed = true;
        }
      }
    }
  }
  Result<Value> ask(Client& who, RequestId id) {
    pump();
    const auto found = who.done.find(id);
    if (found == who.done.end()) throw std::runtime_error("no answer");
    return found->second;
  }
  Result<Value> get(Client& who, std::string_view member = "speed", std::string_view path = "arm") {
    if (path != "arm") CHECK(ask(who, who.client->find_object(path, home_.now)));
    return ask(who, who.client->get_property(path, member, home_.now));
  }
  Result<Value> set(Client& who, std::string_view member, Value value) {
    return ask(who, who.client->set_property("arm", member, value, home_.now));
  }
  Result<Value> lock(Client& who, LockKind kind = LockKind::user, std::string_view path = "arm") {
    return ask(who, who.client->lock(path, kind, home_.now));
  }
  Result<Value> unlock(Client& who, std::string_view path = "arm") {
    return ask(who, who.client->unlock(path, home_.now));
  }
  RequestId enter(Client& who, std::chrono::milliseconds timeout = std::chrono::milliseconds(-1)) {
    const auto id = who.client->enter_monitor("arm", timeout, home_.now);
    pump();
    return id;
  }
  /// The service gets what `who` has sent, and its answers wait.
  void send(Client& who) { home_.carry(*who.client, *who.service, 1 << 20); }
  /// Time passes in which `who` hears of its service, but gets no answer.
  void hold_answers(Client& who, std::chrono::seconds time) {
    for (auto left = time; left.count() > 0; --left) {
      home_.advance(std::chrono::seconds(1));
      home_.forge(*who.service, [](Message& message) {
        message.begin_entry(EntryType::client_keep_alive_ret, "arm", {}, 1'000'000);
      });
      home_.carry(*who.service, *who.client, 1 << 20);
      who.client->handle_timeout(home_.now);
    }
  }
  Result<Value> exit(Client& who) { return ask(who, who.client->exit_monitor("arm", home_.now)); }
  void advance(std::chrono::milliseconds time) {
    home_.advance(time);
    for (auto& each : clients_) {
      each->client->handle_timeout(home_.now);
      each->service->handle_timeout(home_.now);
    }
    pump();
  }
  /// The stream of a client breaks, as its service hears of it.
  void drop(Client& who) {
    who.service->handle_closed({ErrorCode::connection_error, "gone"}, home_.now);
    pump();
  }
  void replace_session(Client& who) {
    who.service = std::make_unique<ServiceSession>(home_.directory, ServiceSessionOptions{}, home_.now);
  }
  HostedService& service() { return *home_.directory.find("arm"); }
  PlainObject& root() { return *home_.root; }
  const Now& now() const { return home_.now; }

 private:
  bool handle(Client& who, const ServiceEvent& event) {
    if (const auto* called = std::get_if<Called>(&event)) who.service->reply(called->id, answer_to(*called), home_.now);
    if (const auto* login = std::get_if<LoginRequested>(&event))
      who.service->answer_login(login->id, AuthenticatedUser{login->attempt.username, privileges_, {}}, home_.now);
    if (std::holds_alternative<LocksChanged>(event))
      for (auto& each : clients_) each->service->handle_locks_changed(home_.now);
    return true;
  }

  /// Memories have eight numbers.
  static Value answer_to(const Called& called) {
    if (called.kind == CallKind::memory_dimensions) return Value(MemoryShape{8});
    if (called.kind == CallKind::memory_read)
      return Value(std::vector<double>(static_cast<std::size_t>(called.range.count.at(0))));
    return called.member->type.type == DataType::string_t ? Value("x") : Value(1);
  }

  Loopback home_;
  std::vector<std::unique_ptr<Client>> clients_;
  std::vector<std::string> privileges_;
};

std::string why(const Result<Value>& result) {
  return result ? "no error" : std::to_string(static_cast<int>(result.error().code)) + " " + result.error().message;
}

}  // namespace

TEST_CASE("a user lock keeps out other users, from the object and all below it") {
  Clients all;
  auto& alice = all.add("alice");
  auto& bob = all.add("bob");
  auto& nobody = all.add("");
  CHECK(all.get(bob, "name", "arm.tool"));
  CHECK(all.lock(alice));
  CHECK(all.get(alice));
  CHECK(all.get(alice, "name", "arm.tool"));
  for (auto* other : {&bob, &nobody}) {
    CHECK(why(all.get(*other)) == "151 Object locked by alice");
    CHECK(why(all.set(*other, "speed", Value(1.0))) == "151 Object locked by alice");
    CHECK(why(all.ask(*other, other->client->call_function("arm", "stop", {}, all.now()))) ==
          "151 Object locked by alice");
    CHECK(why(all.ask(*other, other->client->connect_wire("arm", "torque", all.now()))) ==
          "151 Object locked by alice");
    CHECK(why(all.get(*other, "name", "arm.tool")) == "151 Object locked by alice");
    CHECK(why(all.get(*other, "name", "arm.tools[later]")) == "151 Object locked by alice");
    // What the definition exempts.
    CHECK(all.get(*other, "status"));
    CHECK(all.set(*other, "status", Value(2)));
    CHECK(all.get(*other, "shown"));
    CHECK(why(all.set(*other, "shown", Value(2.0))) == "151 Object locked by alice");
  }
  auto& alice_again = all.add("alice");
  CHECK(all.get(alice_again));
  CHECK(why(all.lock(alice_again)) == "151 Object already locked");
  CHECK(why(all.lock(bob, LockKind::user, "arm.tool")) == "151 Object already locked");
  CHECK(why(all.unlock(bob)) == "151 Service locked by user alice");
  CHECK(why(all.unlock(alice, "arm.tool")) == "151 Cannot release inherited lock");
  CHECK(all.unlock(alice_again));
  CHECK(all.get(bob));
  CHECK(all.unlock(alice));  // not locked is no error
}

TEST_CASE("an object that is replaced is locked no more, unless what is above it is") {
  Clients all;
  auto& alice = all.add("alice");
  auto& bob = all.add("bob");
  CHECK(all.get(bob, "name", "arm.tool"));
  CHECK(all.get(bob, "name", "arm.tools[a]"));
  CHECK(all.lock(alice, LockKind::user, "arm.tool"));
  CHECK(all.lock(alice, LockKind::client, "arm.tools[a]"));
  CHECK(why(all.get(bob, "name", "arm.tool")) == "151 Object locked by alice");
  all.service().forget_path("arm.tool");
  CHECK(all.get(bob, "name", "arm.tool"));
  CHECK(why(all.get(bob, "name", "arm.tools[a]")) == "151 Object locked by alice");
  CHECK(all.unlock(alice, "arm.tool"));  // not locked is no error
  CHECK(all.lock(bob, LockKind::user, "arm.tool"));
  CHECK(all.unlock(bob, "arm.tool"));
  CHECK(all.unlock(alice, "arm.tools[a]"));

  CHECK(all.lock(alice));
  all.service().forget_path("arm.tool");
  CHECK(why(all.get(bob, "name", "arm.tool")) == "151 Object locked by alice");
}

TEST_CASE("a locked object's memories are locked; those with nolockread can still be read") {
  Clients all;
  auto& alice = all.add("alice");
  auto& bob = all.add("bob");
  const MemoryShape position{0}, count{8};
  const auto read = [&](Clients::Client& who, std::string_view memory) {
    return all.ask(who, who.client->read_memory("arm", memory, position, count, all.now()));
  };
  const auto measure = [&](Clients::Client& who, std::string_view memory) {
    return all.ask(who, who.client->get_memory_dimensions("arm", memory, all.now()));
  };
  const auto write = [&](Clients::Client& who, std::string_view memory) {
    return all.ask(who, who.client->write_memory("arm", memory, position, Value(std::vector<double>(8)), all.now()));
  };
  CHECK(all.lock(alice));
  for (const auto* memory : {"data", "archive"}) {
    CHECK(read(alice, memory));
    CHECK(write(alice, memory));
    CHECK(why(write(bob, memory)) == "151 Object locked by alice");
  }
  CHECK(read(bob, "archive"));
  CHECK(measure(bob, "archive"));
  CHECK(why(read(bob, "data")) == "151 Object locked by alice");
  CHECK(why(measure(bob, "data")) == "151 Object locked by alice");
}

TEST_CASE("what was connected before a lock can be disconnected by everybody") {
  Clients all;
  auto& alice = all.add("alice");
  auto& bob = all.add("bob");
  CHECK(all.ask(bob, bob.client->connect_wire("arm", "torque", all.now())));
  CHECK(all.lock(alice));
  all.enter(alice);
  CHECK(why(all.ask(bob, bob.client->disconnect_wire("arm", "torque", all.now()))) == "no error");
  CHECK_FALSE(bob.service->has_wire("arm", "torque"));
}

TEST_CASE("a lock of a child leaves its parent and its siblings alone") {
  Clients all;
  auto& alice = all.add("alice");
  auto& bob = all.add("bob");
  CHECK(all.lock(alice, LockKind::user, "arm.slots[1]"));
  CHECK(all.get(bob));
  CHECK(all.get(bob, "name", "arm.slots[10]"));
  CHECK(all.get(bob, "name", "arm.tool"));
  CHECK(why(all.lock(bob)) == "151 Object already locked");
  CHECK(why(all.get(bob, "name", "arm.slots[1]")) == "151 Object locked by alice");
  SECTION("other spellings of its path are the same object") {
    CHECK(all.lock(alice, LockKind::user, "arm.tools[a%2db]"));
    CHECK(why(all.get(bob, "name", "arm.tools[a%2Db]")) == "151 Object locked by alice");
    CHECK(why(all.lock(bob, LockKind::user, "arm.tools[a-b]")) == "151 Object already locked");
  }
  SECTION("or are refused") {
    CHECK(all.lock(alice, LockKind::user, "arm.tool"));
    const auto refused = [&](std::string_view path) { return why(all.lock(bob, LockKind::user, path)).substr(0, 3); };
    CHECK(refused("arm.slots[01]") == "18 ");
    CHECK(refused("arm.slots[%31]") == "8 I");
    CHECK(refused("arm.tool[7]") == "18 ");
  }
  CHECK(why(all.lock(bob, LockKind::user, "arm.nothing")).substr(0, 2) == "9 ");
}

TEST_CASE("a client lock keeps out the user's other sessions too") {
  Clients all;
  auto& first = all.add("alice");
  auto& second = all.add("alice");
  auto& root = all.add("root", {"objectlockoverride"});
  CHECK(all.lock(first, LockKind::client));
  CHECK(all.get(first));
  CHECK(why(all.get(second)) == "151 Object locked by alice");
  SECTION("it ends with the client") {
    all.drop(first);
    CHECK(all.get(second));
  }
  SECTION("any session of the user releases it, as at the reference") {
    CHECK(all.unlock(second));
    CHECK(all.get(root));
  }
  SECTION("so does whoever may override") {
    CHECK(all.unlock(root));
    CHECK(all.get(second));
  }
  SECTION("and logging out") {
    CHECK(all.ask(first, first.client->logout(all.now())));
    CHECK(all.get(second));
  }
}

TEST_CASE("a user lock ends with the last session of the user") {
  Clients all;
  auto& first = all.add("alice");
  auto& second = all.add("alice");
  auto& bob = all.add("bob");
  CHECK(all.lock(first));
  all.drop(first);
  CHECK(why(all.get(bob)) == "151 Object locked by alice");
  SECTION("which goes") {
    all.drop(second);
  }
  SECTION("or logs out") {
    CHECK(all.ask(second, second.client->logout(all.now())));
  }
  SECTION("or in as somebody else") {
    CHECK(all.ask(second, second.client->authenticate("eve", Value(MapString{}), all.now())));
  }
  SECTION("or is destroyed with its driver") {
    all.replace_session(second);
  }
  CHECK(all.service().object_locks().empty());
  CHECK(all.get(bob));
}

TEST_CASE("a user who logs in again keeps what is locked") {
  Clients all;
  auto& alice = all.add("alice");
  auto& bob = all.add("bob");
  CHECK(all.lock(alice, LockKind::user, "arm.tool"));
  CHECK(all.lock(alice, LockKind::client, "arm.slots[1]"));
  CHECK(all.ask(alice, alice.client->authenticate("alice", Value(MapString{}), all.now())));
  for (const auto* path : {"arm.tool", "arm.slots[1]"}) {
    CHECK(all.get(alice, "name", path));
    CHECK(why(all.get(bob, "name", path)) == "151 Object locked by alice");
  }
  all.drop(alice);
  CHECK(all.service().object_locks().empty());
}

TEST_CASE("who may not lock, and where nobody may") {
  Clients all;
  auto& nobody = all.add("");
  auto& guest = all.add("guest", {"drive"});
  CHECK(why(all.lock(nobody)) == "150 User is not authenticated");
  CHECK(why(all.unlock(nobody)) == "150 User is not authenticated");
  CHECK(why(all.lock(guest)) == "151 User does not have object locking privileges");
  Clients strict(false);
  auto& alice = strict.add("alice");
  CHECK(why(strict.lock(alice)) == "152 This service does not allow object locks");
}

TEST_CASE("the number of locks is bounded") {
  Clients all;
  auto& alice = all.add("alice");
  Result<Value> last = Value{};
  for (int i = 0; i <= 1024; ++i) last = all.lock(alice, LockKind::user, "arm.slots[" + std::to_string(i) + "]");
  CHECK(last.error().code == ErrorCode::out_of_system_resource);
  CHECK(all.service().object_locks().size() == 1024);
  all.drop(alice);
  CHECK(all.service().object_locks().empty());
}

TEST_CASE("a monitor lets one in; the others' requests fail, those that enter wait") {
  Clients all;
  auto& first = all.add("");
  auto& second = all.add("");
  auto& third = all.add("");
  CHECK(all.ask(first, all.enter(first)).value().is_null());
  CHECK(all.get(first));
  CHECK(why(all.get(second)) == "17 Object is currently monitor locked. Use MonitorEnter to obtain monitor lock");
  CHECK(why(all.get(second, "status")).substr(0, 2) == "17");  // nolock is for object locks
  CHECK(all.get(second, "name", "arm.tool"));                  // a monitor has no children
  CHECK(why(all.ask(first, all.enter(first))) == "17 Already acquiring or acquired monitor lock");
  CHECK(why(all.exit(second)) == "17 Not monitor locked");

  const auto waits = all.enter(second);
  const auto also_waits = all.enter(third);
  CHECK_FALSE(second.done.contains(waits));
  CHECK(all.exit(first));
  CHECK(all.ask(second, waits));
  CHECK_FALSE(third.done.contains(also_waits));
  CHECK(all.get(second));
  CHECK(all.exit(second));
  CHECK(all.ask(third, also_waits));
  CHECK(all.exit(third));
  CHECK(all.get(first));
}

TEST_CASE("a long wait goes on in turns of five seconds, under one request") {
  Clients all;
  auto& first = all.add("");
  auto& second = all.add("");
  CHECK(all.ask(first, all.enter(first)));
  const auto waits = all.enter(second);
  for (int turn = 0; turn < 20; ++turn) {  // 100 s: longer than any request may take
    all.advance(std::chrono::seconds(5));
    CHECK(all.get(first));  // the owner is not idle
    CHECK_FALSE(second.done.contains(waits));
  }
  CHECK(all.exit(first));
  CHECK(all.ask(second, waits));
}

TEST_CASE("a monitor that comes free between two turns is taken by the next") {
  Clients all;
  auto& first = all.add("");
  auto& second = all.add("");
  CHECK(all.ask(first, all.enter(first)));
  const auto waits = all.enter(second);
  all.advance(std::chrono::seconds(5));
  CHECK(all.exit(first));
  CHECK(all.ask(second, waits));
  CHECK(why(all.get(first)).substr(0, 2) == "17");
}

TEST_CASE("an object that was replaced goes, though its monitor was entered") {
  Clients all;
  auto& first = all.add("");
  CHECK(all.get(first, "name", "arm.tool"));
  CHECK(all.ask(first, first.client->enter_monitor("arm.tool", std::chrono::milliseconds(-1), all.now())));
  CHECK(all.ask(first, first.client->exit_monitor("arm.tool", all.now())));
  const std::weak_ptr<ServiceObject> tool = all.service().find_object("arm.tool").value().object;
  all.service().forget_path("arm.tool");
  CHECK(tool.expired());
}

TEST_CASE("a wait for a monitor has an end") {
  Clients all;
  auto& first = all.add("");
  auto& second = all.add("");
  CHECK(all.ask(first, all.enter(first)));
  CHECK(why(all.ask(second, all.enter(second, std::chrono::milliseconds(0)))) ==
        "110 the monitor lock was not free in time");
  const auto waits = all.enter(second, std::chrono::milliseconds(1500));
  CHECK(second.service->poll_timeout() == all.now().steady + std::chrono::milliseconds(1500));
  all.advance(std::chrono::milliseconds(1499));
  CHECK_FALSE(second.done.contains(waits));
  all.advance(std::chrono::milliseconds(1));
  CHECK(why(all.ask(second, waits)) == "110 the monitor lock was not free in time");
  CHECK(all.exit(first));
  CHECK(all.get(second));
}

TEST_CASE("an owner that does nothing for 30 s has lost its monitor") {
  Clients all;
  auto& first = all.add("");
  auto& second = all.add("");
  CHECK(all.ask(first, all.enter(first)));
  all.advance(std::chrono::seconds(20));
  CHECK(all.get(first));
  const auto waits = all.enter(second);
  for (int i = 0; i < 29; ++i) all.advance(std::chrono::seconds(1));
  CHECK_FALSE(second.done.contains(waits));
  all.advance(std::chrono::seconds(1));
  CHECK(all.ask(second, waits));
  CHECK(why(all.exit(first)) == "17 Not monitor locked");
}

TEST_CASE("whoever goes frees its monitor and its place in the queue") {
  Clients all;
  auto& first = all.add("");
  auto& second = all.add("");
  auto& third = all.add("");
  CHECK(all.ask(first, all.enter(first)));
  const auto waits = all.enter(second);
  const auto also_waits = all.enter(third);
  SECTION("the one that waits") {
    all.drop(second);
    CHECK(all.exit(first));
    CHECK(all.ask(third, also_waits));
  }
  SECTION("the owner") {
    all.drop(first);
    CHECK(all.ask(second, waits));
    CHECK_FALSE(third.done.contains(also_waits));
  }
  SECTION("both") {
    all.drop(second);
    all.drop(first);
    CHECK(all.ask(third, also_waits));
  }
  SECTION("the owner, orderly") {
    first.client->disconnect(all.now());
    all.pump();
    CHECK(all.ask(second, waits));
  }
}

TEST_CASE("objects without monitor say so; leaving one that was never locked is no error") {
  Clients all;
  auto& first = all.add("");
  CHECK(all.exit(first));
  all.root().has_monitor = false;
  CHECK(why(all.ask(first, all.enter(first))) == "18 Object is not monitor lockable");
  CHECK(all.exit(first));
}

TEST_CASE("urgent messages go ahead of what waits, in their own order") {
  Loopback pair;
  pair.connect();
  const auto& type = pair.service->service()->root_type();
  const auto send = [&](std::string_view event, std::vector<Value> arguments) {
    REQUIRE(pair.service->send_event("arm", *type.find_member(event), arguments, pair.now));
  };
  send("bumped", {Value(1), Value("wall")});
  send("alarmed", {Value(2)});
  send("bumped", {Value(3), Value("wall")});
  send("alarmed", {Value(4)});
  pair.pump();
  std::vector<std::int32_t> order;
  while (auto event = pair.client->poll_event())
    order.push_back(std::get<EventReceived>(*event).arguments.front().to<std::int32_t>().value());
  CHECK(order == std::vector<std::int32_t>{2, 4, 1, 3});

  order.clear();
  const auto ordinary = pair.client->get_property("arm", "speed", pair.now);
  const auto urgent = pair.client->get_property("arm", "alarm", pair.now);
  pair.pump();
  CHECK(pair.next_service<Called>().member->name == "alarm");
  CHECK(pair.next_service<Called>().member->name == "speed");
  CHECK(ordinary < urgent);
}

TEST_CASE("an urgent message waits for no others than the one that is being written") {
  Loopback pair;
  pair.connect();
  const auto alarm = [&] { pair.client->set_property("arm", "alarm", Value(std::int32_t{1}), pair.now); };
  const auto receive = [&](ByteSpan bytes) { pair.service->handle_bytes(bytes, pair.now); };
  std::vector<std::string> received;
  const auto drain = [&] {
    pair.carry(*pair.client, *pair.service, 1u << 20);
    while (const auto event = pair.service->poll_event()) received.push_back(std::get<Called>(*event).member->name);
  };
  SECTION("of which the stream took a part") {
    for (int i = 0; i < 3; ++i) pair.client->set_property("arm", "speed", Value(1.0), pair.now);
    receive(pair.client->poll_transmit().front().first(5));
    pair.client->handle_transmitted(5, pair.now);
    alarm();
    drain();
    CHECK(received == std::vector<std::string>{"speed", "alarm", "speed", "speed"});
  }
  SECTION("which was handed out") {
    const Value pose(
        Structure{"experimental.loopback.Pose", {{"x", Value(1.0)}, {"joints", Value(std::vector<double>(50'000))}}});
    for (int i = 0; i < 3; ++i) pair.client->set_property("arm", "pose", pose, pair.now);
    const auto slices = pair.client->poll_transmit();
    alarm();
    std::size_t size = 0;
    for (const auto slice : slices) {
      const auto part = slice.first(std::min(slice.size(), TransmitQueue::write_size - size));
      receive(part);
      size += part.size();
    }
    CHECK(size == TransmitQueue::write_size);
    pair.client->handle_transmitted(size, pair.now);
    for (int i = 0; i < 3; ++i) drain();
    CHECK(received == std::vector<std::string>{"pose", "alarm", "pose", "pose"});
  }
}

TEST_CASE("a lock or monitor that is granted when its client has given it up is given back") {
  Clients all;
  auto& alice = all.add("alice");
  auto& bob = all.add("bob");
  alice.client->set_request_timeout(std::chrono::seconds(1));
  const auto give_up = [&](RequestId id) {
    const bool is_cancelled = GENERATE(false, true);
    all.send(alice);
    if (is_cancelled) {
      alice.client->cancel(id);
      all.pump();
      CHECK_FALSE(alice.done.contains(id));
    } else {
      all.advance(std::chrono::seconds(1));
      CHECK(all.ask(alice, id).error().code == ErrorCode::request_timeout);
    }
  };
  SECTION("lock") {
    const auto kind = GENERATE(LockKind::user, LockKind::client);
    give_up(alice.client->lock("arm", kind, all.now()));
    CHECK(all.service().object_locks().empty());
    CHECK(all.lock(bob));
  }
  SECTION("monitor") {
    give_up(alice.client->enter_monitor("arm", std::chrono::milliseconds(-1), all.now()));
    CHECK(all.ask(bob, all.enter(bob)));
  }
  CHECK(alice.client->pending_requests() == 0);
}

TEST_CASE("a monitor that a client waits for no more goes to the next one") {
  Clients all;
  auto& first = all.add("");
  auto& second = all.add("");
  auto& third = all.add("");
  CHECK(all.ask(first, all.enter(first)));
  second.client->cancel(all.enter(second));
  const auto waits = all.enter(third);
  all.advance(std::chrono::seconds(5));  // the second is told to go on waiting
  CHECK(all.exit(first));
  CHECK(all.ask(third, waits));
}

TEST_CASE("a lock that was given up is kept if it was asked for anew since") {
  Clients all;
  auto& alice = all.add("alice");
  const auto first = alice.client->lock("arm", LockKind::user, all.now());
  alice.client->cancel(first);
  const auto unlocked = alice.client->unlock("arm", all.now());
  CHECK(all.lock(alice));
  CHECK(all.ask(alice, unlocked));
  CHECK(all.service().object_locks().size() == 1);
}

TEST_CASE("what is given up and never answered is forgotten") {
  Clients all;
  auto& alice = all.add("alice");
  alice.client->set_request_timeout(std::chrono::seconds(1));
  alice.client->cancel(alice.client->lock("arm", LockKind::user, all.now()));
  CHECK(alice.client->pending_requests() == 1);
  all.hold_answers(alice, std::chrono::seconds(61));
  CHECK(alice.client->pending_requests() == 0);
}
