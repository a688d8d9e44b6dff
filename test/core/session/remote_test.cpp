// Services whose objects are another node's: what waits for them, and what clients see meanwhile.
#include <catch2/catch.hpp>

#include "test/core/session/loopback.hpp"
#include "test/support/print.hpp"

using namespace rr;
using namespace rr::test;

namespace {

struct Anybody final : Authenticator {
  Result<AuthenticatedUser> authenticate(const LoginAttempt& attempt) const override {
    return AuthenticatedUser{attempt.username};
  }
};

class Remote : public Loopback {
 public:
  Remote() {
    hosted().set_remote();
    connect();
  }
  HostedService& hosted() { return *directory.find("arm"); }
  const MemberDefinition& member(std::string_view name) { return *hosted().root_type().find_member(name); }
  Result<> send(const MemberDefinition& wire, const WireValue& value) {
    WirePacket packet("arm", wire, value.value, value.time, now.steady);
    return service->send_wire(packet, now);
  }
  /// As alice, where the policy lets anybody in.
  void log_in(SecurityPolicy policy) {
    policy.authenticator = std::make_shared<Anybody>();
    hosted().set_policy(policy);
    const auto login = client->authenticate("alice", Value(MapString{}), now);
    pump();
    service->answer_login(next_service<LoginRequested>().id, AuthenticatedUser{"alice"}, now);
    next_service<UserChanged>();
    CHECK(service->user()->name == "alice");
    REQUIRE(completion(login));
  }
  void find(const std::string& path) {
    hosted().add_object(path, std::make_shared<PlainObject>("experimental.loopback.Tool")).value();
    service->handle_object_found(path, {}, now);
  }
};

}  // namespace

TEST_CASE("a remote service is asked for objects, and requests wait for them") {
  Remote pair;
  const auto looked_up = pair.client->find_object("arm.tool", pair.now);
  pair.pump();
  CHECK(pair.next_service<ObjectWanted>().path == "arm.tool");
  CHECK_FALSE(pair.client->poll_event());
  pair.find("arm.tool");
  CHECK(pair.completion(looked_up).value() == Value("experimental.loopback.Tool"));

  SECTION("what is known is not asked for again") {
    const auto got = pair.client->get_property("arm.tool", "name", pair.now);
    pair.pump();
    const auto called = pair.next_service<Called>();
    pair.service->reply(called.id, Value("gripper"), pair.now);
    CHECK(pair.completion(got).value() == Value("gripper"));
  }
  SECTION("a client that has found it before the service forgot it just goes on") {
    CHECK(pair.hosted().forget_path("arm.tool").size() == 1);
    const auto first = pair.client->get_property("arm.tool", "name", pair.now);
    const auto second = pair.client->set_property("arm.tool", "name", Value("hammer"), pair.now);
    pair.pump();
    CHECK(pair.next_service<ObjectWanted>().path == "arm.tool");
    CHECK_FALSE(pair.service->poll_event());  // asked for once
    pair.find("arm.tool");
    auto called = pair.next_service<Called>();
    CHECK(called.kind == CallKind::property_get);
    pair.service->reply(called.id, Value("gripper"), pair.now);
    CHECK(pair.completion(first).value() == Value("gripper"));
    called = pair.next_service<Called>();
    CHECK(called.arguments.front() == Value("hammer"));
    pair.service->reply(called.id, Value(), pair.now);
    CHECK(pair.completion(second));
  }
}

TEST_CASE("what a remote object is refused with reaches the client as it is") {
  Remote pair;
  const auto looked_up = pair.client->find_object("arm.tools[a]", pair.now);
  pair.pump();
  pair.next_service<ObjectWanted>();
  pair.service->handle_object_found("arm.tools[a]", Error{ErrorCode::remote_error, "jammed", "com.x.Jammed"}, pair.now);
  const auto error = pair.completion(looked_up).error();
  CHECK(error.qualified_name() == "com.x.Jammed");
  CHECK(error.message == "jammed");
}

TEST_CASE("requests that wait for objects are bounded") {
  Remote pair;
  std::vector<RequestId> ids;
  ids.reserve(65);
  for (int i = 0; i < 65; ++i)
    ids.push_back(pair.client->find_object("arm.slots[" + std::to_string(i) + "]", pair.now));
  CHECK(pair.completion(ids.back()).error().code == ErrorCode::out_of_system_resource);
}

TEST_CASE("what waits for objects is bounded in bytes, too") {
  Remote pair;
  pair.find("arm.tool");
  CHECK(pair.completion(pair.client->find_object("arm.tool", pair.now)));
  CHECK(pair.hosted().forget_path("arm.tool").size() == 1);
  const Value name(std::string(5'000'000, 'x'));
  std::vector<RequestId> ids;
  ids.reserve(3);
  for (int i = 0; i < 3; ++i) ids.push_back(pair.client->set_property("arm.tool", "name", name, pair.now));
  CHECK(pair.completion(ids.back()).error().code == ErrorCode::out_of_system_resource);
}

TEST_CASE("a message of more requests than may wait for objects is not kept for each of them") {
  Remote pair;
  std::vector<std::string> paths;  // a message borrows them
  paths.reserve(65);
  for (int i = 0; i < 65; ++i) paths.push_back("arm.slots[" + std::to_string(i) + "]");
  pair.forge(*pair.client, [&paths](Message& message) {
    std::uint32_t id = 0;
    for (const auto& path : paths) message.begin_entry(EntryType::property_get_req, path, "name", ++id);
  });
  pair.pump();
  CHECK_FALSE(pair.service->poll_event());
}

TEST_CASE("paths of other services are refused at once") {
  Remote pair;
  const auto error =
      pair.answer_to([](Message& message) { message.begin_entry(EntryType::property_get_req, "leg.tool", "name", 7); });
  CHECK(error.code == ErrorCode::object_not_found);
}

TEST_CASE("a wire of a remote service is connected when that one says so") {
  Remote pair;
  const auto connecting = pair.client->connect_wire("arm", "torque", pair.now);
  pair.pump();
  pair.next_service<WireConnected>();
  const auto& torque = pair.member("torque");
  const WireValue early{TimeSpec{1'600'000'000, 5}, Value(2.5)};

  SECTION("the newest value follows the answer, with its own time") {
    CHECK(pair.send(torque, {TimeSpec{1'600'000'000, 4}, Value(1.5)}));
    CHECK(pair.send(torque, early));
    pair.pump();
    CHECK_FALSE(pair.client->poll_event());
    pair.advance(std::chrono::milliseconds(3));
    pair.service->answer_wire("arm", torque, {}, pair.now);
    CHECK(pair.completion(connecting));
    const auto received = pair.next_client<WireValueReceived>();
    CHECK(received.value == Value(2.5));
    CHECK(received.time == early.time);
    std::size_t count = 0;
    pair.service->visit_ledgers([&](const std::string& path, const MemberDefinition& member, const Ledger& ledger) {
      ++count;
      CHECK(path == "arm");
      CHECK(member.name == "torque");
      CHECK(ledger.delivered == 1);
      CHECK(ledger.conflated == 1);
      CHECK(ledger.ages.quantile(0.5) >= std::chrono::milliseconds(3));
      CHECK(ledger.ages.quantile(0.5) <= std::chrono::milliseconds(6));
    });
    CHECK(count == 1);
  }
  SECTION("times go forward even where the other node's clock does not") {
    pair.service->answer_wire("arm", torque, {}, pair.now);
    CHECK(pair.completion(connecting));
    for (int i = 0; i < 2; ++i) {
      CHECK(pair.send(torque, early));
      pair.pump();
      CHECK(pair.next_client<WireValueReceived>().time.nanoseconds == 5 + i);
    }
  }
  SECTION("it refuses") {
    pair.service->answer_wire("arm", torque, make_error(ErrorCode::object_locked_error, "locked"), pair.now);
    CHECK(pair.completion(connecting).error().code == ErrorCode::object_locked_error);
    CHECK_FALSE(pair.service->has_wire("arm", "torque"));
  }
  SECTION("the client has enough") {
    pair.service->answer_wire("arm", torque, {}, pair.now);
    CHECK(pair.completion(connecting));
    pair.client->disconnect_wire("arm", "torque", pair.now);
    pair.pump();
    CHECK(pair.next_service<WireDisconnected>().path == "arm");
  }
}

TEST_CASE("a wire that a remote service has not connected yet is asked for anew, or given up") {
  Remote pair;
  const auto first = pair.client->connect_wire("arm", "torque", pair.now);
  pair.pump();
  pair.next_service<WireConnected>();
  const auto& torque = pair.member("torque");
  SECTION("anew: the last request is the one that is answered") {
    const auto second = pair.client->connect_wire("arm", "torque", pair.now);
    const auto aborted = pair.completion(first).error();
    CHECK(aborted.code == ErrorCode::operation_aborted);
    CHECK(aborted.message == "the wire was asked for anew");
    CHECK_FALSE(pair.client->poll_event());
    CHECK_FALSE(pair.service->poll_event());
    SECTION("it is connected") {
      pair.service->answer_wire("arm", torque, {}, pair.now);
      CHECK(pair.completion(second));
      CHECK(pair.client->send_wire("arm", "torque", Value(1.0), pair.now));
    }
    SECTION("it is refused") {
      pair.service->answer_wire("arm", torque, make_error(ErrorCode::object_locked_error, "locked"), pair.now);
      CHECK(pair.completion(second).error().code == ErrorCode::object_locked_error);
      CHECK_FALSE(pair.service->has_wire("arm", "torque"));
    }
  }
  SECTION("given up: the request is answered first") {
    const auto disconnecting = pair.client->disconnect_wire("arm", "torque", pair.now);
    const auto aborted = pair.completion(first).error();
    CHECK(aborted.code == ErrorCode::operation_aborted);
    CHECK(aborted.message == "the wire was disconnected");
    CHECK(pair.completion(disconnecting));
    CHECK(pair.next_service<WireDisconnected>().path == "arm");
    CHECK_FALSE(pair.service->has_wire("arm", "torque"));
  }
}

TEST_CASE("what subscriptions had stays counted when they are over") {
  Remote pair;
  const auto connect = [&] {
    pair.client->connect_wire("arm", "torque", pair.now);
    pair.pump();
    pair.service->answer_wire("arm", pair.member("torque"), {}, pair.now);
    pair.pump();
    CHECK(pair.service->has_wire("arm", "torque"));
    while (pair.service->poll_event() || pair.client->poll_event()) {
    }
  };
  const auto open_pipe = [&] {
    pair.client->connect_pipe("arm", "poses", any_pipe_index, pair.now);
    pair.pump();
    return pair.next_service<PipeConnected>().id;
  };
  const auto send = [&](int count) {
    for (int i = 0; i < count; ++i)
      CHECK(pair.service->send_wire("arm", pair.member("torque"), Value(1.0 * i), pair.now));
  };
  const auto delivered = [&] {
    const auto total = pair.service->total_ledgers();
    CHECK(total.wires.ages.total() == total.wires.delivered);
    return std::pair(total.wires.delivered, total.pipes.delivered);
  };
  connect();
  send(3);
  const auto pipe = open_pipe();
  CHECK(pair.service->send_pipe_packet(pipe, Value(), pair.now));
  CHECK(delivered() == std::pair<std::uint64_t, std::uint64_t>{3, 1});
  pair.client->disconnect_wire("arm", "torque", pair.now);
  pair.pump();
  CHECK(delivered() == std::pair<std::uint64_t, std::uint64_t>{3, 1});
  connect();
  send(2);
  pair.service->close_wire("arm", pair.member("torque"), pair.now);
  pair.service->close_pipe(pipe, pair.now);
  CHECK(delivered() == std::pair<std::uint64_t, std::uint64_t>{5, 1});
  pair.pump();
  connect();
  send(1);
  const auto last = open_pipe();
  CHECK(pair.service->send_pipe_packet(last, Value(), pair.now));
  pair.service->release_path("arm", pair.now);
  CHECK(delivered() == std::pair<std::uint64_t, std::uint64_t>{6, 2});
  connect();
  send(1);
  pair.service->handle_closed(make_error(ErrorCode::connection_error, "gone"), pair.now);
  CHECK(delivered() == std::pair<std::uint64_t, std::uint64_t>{7, 2});
}

TEST_CASE("a remote service remembers what clients use of it, however much others look for") {
  Remote pair;
  const auto looked_up = pair.client->find_object("arm.tool", pair.now);
  pair.pump();
  pair.next_service<ObjectWanted>();
  pair.find("arm.tool");
  CHECK(pair.completion(looked_up));
  const auto connecting = pair.client->connect_wire("arm.tool", "force", pair.now);
  pair.pump();
  const auto& force = *pair.next_service<WireConnected>().member;
  pair.service->answer_wire("arm.tool", force, {}, pair.now);
  CHECK(pair.completion(connecting));
  SECTION("what is found again is used still") {
    pair.find("arm.tool");
  }
  for (int i = 0; i < 5000; ++i) pair.find(slot(i));
  CHECK(pair.hosted().has_object("arm.tool"));
  CHECK(pair.hosted().has_object(slot(4999)));
  CHECK(pair.client->send_wire("arm.tool", "force", Value(2.5), pair.now));
  pair.pump();
  CHECK(pair.next_service<WireReceived>().value == Value(2.5));
}

TEST_CASE("no client of a remote service takes the paths of all others") {
  Remote pair;
  const auto use = [&](const std::string& path) {
    const auto looked_up = pair.client->find_object(path, pair.now);
    pair.pump();
    if (pair.service->poll_event()) pair.find(path);
    return pair.completion(looked_up);
  };
  for (int i = 0; i < 5000; ++i) use(slot(i)).value();
  for (const auto i : {0, 1023, 4999}) CHECK(pair.hosted().has_object(slot(i)));
  CHECK_FALSE(pair.hosted().has_object(slot(1024)));
  CHECK(use(slot(1024)));  // one that was forgotten is found again
}

TEST_CASE("callbacks and refusals of a remote service go ahead of its data") {
  Remote pair;
  pair.client->connect_pipe("arm", "samples", any_pipe_index, pair.now);
  pair.pump();
  const auto pipe = pair.next_service<PipeConnected>().id;
  pair.service->accept_pipe(pipe, pair.now);
  pair.pump();
  pair.next_client<Completed>();
  for (int i = 0; i < 3; ++i) CHECK(pair.service->send_pipe_packet(pipe, Value(1.0 * i), pair.now));
  const std::vector<Value> question{Value(7)};
  CHECK(pair.service->call_callback("arm", pair.member("notice"), question, pair.now));
  const auto refused = pair.client->find_object("leg", pair.now);
  pair.pump();
  CHECK(pair.next_client<CallbackCalled>().member == "notice");
  CHECK(pair.next_client<Completed>().id == refused);
  CHECK(pair.next_client<PipePacketReceived>().value == Value(0.0));
}

TEST_CASE("locks are a remote service's own") {
  Remote pair;
  const auto entering = pair.client->enter_monitor("arm", std::chrono::milliseconds(-1), pair.now);
  pair.pump();
  const auto wanted = pair.next_service<LockWanted>();
  CHECK(wanted.command == LockCommand::enter_monitor);
  CHECK(wanted.path == "arm");
  CHECK(wanted.timeout == std::chrono::milliseconds(-1));

  SECTION("granted") {
    pair.service->answer_lock(wanted.id, {}, pair.now);
    CHECK(pair.completion(entering));
  }
  SECTION("refused") {
    pair.service->answer_lock(wanted.id, make_error(ErrorCode::operation_timeout, "no"), pair.now);
    CHECK(pair.completion(entering).error().code == ErrorCode::operation_timeout);
  }
  SECTION("a client that waits long is told to go on waiting") {
    for (int i = 0; i < 3; ++i) {
      CHECK(pair.service->poll_timeout() <= pair.now.steady + std::chrono::seconds(5));
      pair.advance(std::chrono::seconds(5));
      pair.service->handle_timeout(pair.now);
      pair.client->handle_timeout(pair.now);
      pair.pump();
      CHECK_FALSE(pair.client->poll_event());
      CHECK_FALSE(pair.service->poll_event());
    }
    pair.service->answer_lock(wanted.id, {}, pair.now);
    CHECK(pair.completion(entering));
  }
}

TEST_CASE("whoever leaves a remote service is told so when everything is given up there") {
  Remote pair;
  pair.client->disconnect(pair.now);
  pair.pump();
  pair.next_service<LeaveWanted>();
  CHECK(pair.client->state() == ClientState::closing);
  pair.service->answer_leave(pair.now);
  pair.next_service<ClientGone>();
  pair.pump();
  pair.next_client<SessionClosed>();
  CHECK(pair.client->state() == ClientState::closed);
}

TEST_CASE("what a client of a remote service sends behind its disconnect is left out") {
  Remote pair;
  pair.client->find_object("arm.tool", pair.now);
  pair.pump();
  pair.next_service<ObjectWanted>();
  pair.client->disconnect(pair.now);
  pair.forge(*pair.client, [](Message& message) {
    message.begin_entry(EntryType::wire_connect_req, "arm", "torque", 77);
    message.begin_entry(EntryType::pipe_connect_req, "arm", "samples", 78);
  });
  pair.pump();
  pair.next_service<LeaveWanted>();
  CHECK_FALSE(pair.service->poll_event());
  pair.find("arm.tool");  // nor does what has waited go on
  CHECK_FALSE(pair.service->poll_event());
}

TEST_CASE("a remote service hears that its client is another user") {
  Remote pair;
  pair.log_in(SecurityPolicy());
  const auto logout = pair.client->logout(pair.now);
  pair.pump();
  pair.next_service<UserChanged>();
  CHECK_FALSE(pair.service->user());
  CHECK(pair.completion(logout));
}

TEST_CASE("whoever may do nothing makes a remote service look for nothing") {
  Loopback pair;
  pair.directory.find("arm")->set_remote();
  ServiceSessionOptions options;
  options.admit = [](const MemberAccess& access) -> Result<> {
    if (access.type == EntryType::connect_client_combined) return {};
    CHECK(access.type == EntryType::object_type_name);
    CHECK(access.path == "arm.tool");
    return make_error(ErrorCode::permission_denied, "not you");
  };
  pair.service = std::make_unique<ServiceSession>(pair.directory, options, pair.now);
  pair.connect();
  const auto looked_up = pair.client->find_object("arm.tool", pair.now);
  CHECK(pair.completion(looked_up).error().code == ErrorCode::permission_denied);
  CHECK_FALSE(pair.service->poll_event());
}

TEST_CASE("whoever may not use a service is refused as he connects") {
  Loopback pair;
  std::vector<std::string> asked;
  ServiceSessionOptions options;
  options.admit = [&](const MemberAccess& access) -> Result<> {
    CHECK(access.type == EntryType::connect_client_combined);
    CHECK_FALSE(access.member);
    asked.emplace_back(std::string(access.path) + " " + (access.user ? access.user->name : "nobody"));
    if (access.user && access.user->name == "alice") return {};
    return make_error(ErrorCode::permission_denied, "not you");
  };
  const auto begin = [&] { pair.service = std::make_unique<ServiceSession>(pair.directory, options, pair.now); };
  begin();
  CHECK_THROWS_WITH(pair.connect(), Catch::Contains("not you"));
  CHECK_FALSE(pair.service->service());
  CHECK_FALSE(pair.service->poll_event());
  CHECK(asked == std::vector<std::string>{"arm nobody"});
}

TEST_CASE("what a client may do is asked before it is done") {
  Loopback pair;
  std::vector<std::pair<EntryType, std::string>> asked;
  ServiceSessionOptions options;
  options.admit = [&](const MemberAccess& access) -> Result<> {
    if (access.type == EntryType::connect_client_combined) return {};
    asked.emplace_back(access.type, access.member ? access.member->name : "-");
    if (!access.member || access.member->name != "speed") return make_error(ErrorCode::permission_denied, "not you");
    return {};
  };
  pair.service = std::make_unique<ServiceSession>(pair.directory, options, pair.now);
  pair.connect();
  const auto denied = [&](RequestId id) { return pair.completion(id).error().code == ErrorCode::permission_denied; };
  const auto speed = pair.client->get_property("arm", "speed", pair.now);
  pair.pump();
  pair.service->reply(pair.next_service<Called>().id, Value(1.5), pair.now);
  CHECK(pair.completion(speed).value() == Value(1.5));
  CHECK(denied(pair.client->set_property("arm", "pose", Value(Structure{"experimental.loopback.Pose", {}}),
                                         pair.now)) == false);  // does not even fit
  CHECK(denied(pair.client->get_property("arm", "serial", pair.now)));
  CHECK(denied(pair.client->call_function("arm", "stop", {}, pair.now)));
  CHECK(denied(pair.client->connect_wire("arm", "torque", pair.now)));
  CHECK(denied(pair.client->connect_pipe("arm", "samples", any_pipe_index, pair.now)));
  CHECK(denied(pair.client->enter_monitor("arm", std::chrono::milliseconds(0), pair.now)));
  CHECK_FALSE(pair.service->poll_event());
  CHECK(pair.service->send_event("arm", *pair.directory.find("arm")->root_type().find_member("bumped"),
                                 std::vector<Value>{Value(std::int32_t{1}), Value("left")}, pair.now));
  pair.pump();
  CHECK_FALSE(pair.client->poll_event());
  CHECK(asked.back() == std::pair(EntryType::event_req, std::string("bumped")));
}

TEST_CASE("requests are bounded until they are answered; what is too much is refused, and nothing is lost by it") {
  Remote pair;
  int open = 0;
  std::vector<ErrorCode> answers;
  struct Pass : RequestPass {
    Pass(int& counted, std::vector<ErrorCode>& told) : open(counted), answers(told) { ++open; }
    ~Pass() override { --open; }
    void handle_answer(const Result<>& result) override {
      answers.push_back(result ? ErrorCode::none : result.error().code);
    }
    int& open;
    std::vector<ErrorCode>& answers;
  };
  ServiceSessionOptions options;
  options.enter = [&](const MemberAccess&) -> Result<std::shared_ptr<RequestPass>> {
    if (open == 2) return make_error(ErrorCode::out_of_system_resource, "too much");
    return std::make_shared<Pass>(open, answers);
  };
  ClientOptions client_options;
  client_options.connection.self = {client_id, ""};
  client_options.service = "arm";
  pair.client = std::make_unique<ClientSession>(client_options, pair.now);
  pair.service = std::make_unique<ServiceSession>(pair.directory, options, pair.now);
  pair.connect();
  const auto expect_refused = [&](RequestId id) {
    const auto refused = pair.completion(id);
    REQUIRE_FALSE(refused);
    CHECK(refused.error().code == ErrorCode::out_of_system_resource);
    CHECK(refused.error().message == "too much");
    CHECK_FALSE(pair.service->poll_event());
  };

  const auto generator = pair.client->open_generator("arm", "count", {}, pair.now);
  pair.pump();
  pair.service->reply(pair.next_service<Called>().id, Value{}, pair.now);
  const auto index = pair.completion(generator).value().to<std::int32_t>().value();
  const auto joining = pair.client->connect_wire("arm", "torque", pair.now);
  const auto reading = pair.client->get_property("arm", "speed", pair.now);
  pair.pump();
  pair.next_service<WireConnected>();
  const auto read = pair.next_service<Called>();
  CHECK(open == 2);
  CHECK(answers == std::vector{ErrorCode::none});
  expect_refused(pair.client->next_generator("arm", "count", index, {}, pair.now));
  expect_refused(pair.client->connect_pipe("arm", "samples", any_pipe_index, pair.now));

  SECTION("an answer makes room, and the generator is still there") {
    pair.service->reply(read.id, Value(1.5), pair.now);
    CHECK(pair.completion(reading).value() == Value(1.5));
    CHECK(open == 1);
    const auto next = pair.client->next_generator("arm", "count", index, {}, pair.now);
    pair.pump();
    pair.service->reply(pair.next_service<Called>().id, Value(std::int32_t{7}), pair.now);
    CHECK(pair.completion(next).value() == Value(std::int32_t{7}));
    CHECK(open == 1);
    pair.service->answer_wire("arm", pair.member("torque"), {}, pair.now);
    REQUIRE(pair.completion(joining));
    CHECK(open == 0);
  }
  SECTION("what ends something is never too much, and packets are not") {
    const auto closing = pair.client->close_generator("arm", "count", index, pair.now);
    pair.pump();
    pair.service->reply(pair.next_service<Called>().id, Value{}, pair.now);
    CHECK(pair.completion(closing));
    CHECK(open == 2);
  }
  SECTION("another request of the same number ends the client, not the first one's entry") {
    const auto type = GENERATE(EntryType::client_keep_alive_req, EntryType::get_node_info, EntryType::property_get_req);
    pair.forge(*pair.client, [&](Message& message) {
      message.begin_entry(type, "arm", "nothing", static_cast<std::uint32_t>(reading));
    });
    pair.carry(*pair.client, *pair.service, 1u << 20);
    CHECK(pair.service->wants_close());
    CHECK_THAT(pair.service->connection().close_reason().message, Catch::Contains("is not answered yet"));
    CHECK(open == 0);
    CHECK(answers == std::vector{ErrorCode::none});
  }
  SECTION("so do two that have waited for an object with one number") {
    pair.service->reply(read.id, Value(1.5), pair.now);
    REQUIRE(pair.completion(reading));
    pair.forge(*pair.client, [](Message& message) {
      message.begin_entry(EntryType::property_get_req, "arm.tool", "name", 4711);
      message.begin_entry(EntryType::property_get_req, "arm.tool", "name", 4711);
    });
    pair.carry(*pair.client, *pair.service, 1u << 20);
    pair.next_service<ObjectWanted>();
    pair.find("arm.tool");
    CHECK(pair.service->wants_close());
    CHECK_THAT(pair.service->connection().close_reason().message, Catch::Contains("request 4711"));
  }
  SECTION("what is asked of an object that is replaced is over") {
    pair.service->release_path("arm", pair.now);
    CHECK(open == 1);
  }
  SECTION("the end of the session is the end of all") {
    pair.service->handle_closed(make_error(ErrorCode::connection_error, "gone"), pair.now);
    CHECK(open == 0);
  }
}

TEST_CASE("an object that is gone again when it was found is not looked for without end") {
  Remote pair;
  const auto looked_up = pair.client->find_object("arm.tool", pair.now);
  pair.pump();
  pair.next_service<ObjectWanted>();
  pair.service->handle_object_found("arm.tool", {}, pair.now);
  const auto error = pair.completion(looked_up).error();
  CHECK(error.code == ErrorCode::object_not_found);
  CHECK_THAT(error.message, Catch::Contains("'arm.tool' was found"));
  CHECK_FALSE(pair.service->poll_event());
}

TEST_CASE("connects that wait for an answer get one when their object is replaced, or their user logs out") {
  Remote pair;
  SecurityPolicy policy;
  policy.require_valid_user = true;
  pair.log_in(policy);
  const auto wire = pair.client->connect_wire("arm", "torque", pair.now);
  const auto pipe = pair.client->connect_pipe("arm", "samples", any_pipe_index, pair.now);
  pair.pump();
  pair.next_service<WireConnected>();
  const auto id = pair.next_service<PipeConnected>().id;
  const auto expect_refused = [&](ErrorCode code) {
    for (const auto request : {wire, pipe}) {
      const auto done = pair.next_client<Completed>();
      CHECK(done.id == request);
      REQUIRE_FALSE(done.result);
      CHECK(done.result.error().code == code);
    }
  };
  SECTION("replaced") {
    pair.service->release_path("arm", pair.now);
    pair.pump();
    expect_refused(ErrorCode::object_not_found);
  }
  SECTION("logged out") {
    const auto logout = pair.client->logout(pair.now);
    pair.pump();
    expect_refused(ErrorCode::authentication_error);
    CHECK(pair.completion(logout));
  }
  CHECK(pair.next_service<PipeClosed>().id == id);
  CHECK_FALSE(pair.service->has_wire("arm", "torque"));
  // What the other node says of them now is too late.
  pair.service->answer_wire("arm", pair.member("torque"), {}, pair.now);
  pair.service->accept_pipe(id, pair.now);
  pair.pump();
  CHECK_FALSE(pair.client->poll_event());
}
