// Logins: who gets in, by which request, and what those outside may do.
#include <catch2/catch.hpp>

#include "core/member/error_entry.hpp"
#include "test/core/session/loopback.hpp"
#include "test/core/wire/coded_message.hpp"
#include "test/support/print.hpp"

using namespace rr;
using namespace rr::test;

namespace {

Features no_combined() {
  Features features;
  features.combined_v2 = features.combined_v4 = false;
  return features;
}

/// Never asked: the tests answer LoginRequested themselves.
class NobodysAuthenticator final : public Authenticator {
 public:
  Result<AuthenticatedUser> authenticate(const LoginAttempt&) const override {
    return make_error(ErrorCode::internal_error, "not to be asked");
  }
};

Value password(std::string_view text) {
  MapString credentials;
  credentials.items.emplace_back("password", Value(text));
  return Value(std::move(credentials));
}

ClientOptions login(std::string username, Value credentials, Features features = {}) {
  ClientOptions options;
  options.connection.self = {client_id, "test.client"};
  options.connection.features = features;
  options.service = "arm";
  options.username = std::move(username);
  options.credentials = std::move(credentials);
  return options;
}

/// A loopback whose service `arm` has an authenticator.
struct Guarded : Loopback {
  explicit Guarded(bool require_valid_user) {
    SecurityPolicy policy;
    policy.authenticator = std::make_shared<NobodysAuthenticator>();
    policy.require_valid_user = require_valid_user;
    directory.find("arm")->set_policy(policy);
  }
  void start(ClientOptions options) {
    client = std::make_unique<ClientSession>(std::move(options), now);
    service = std::make_unique<ServiceSession>(directory, ServiceSessionOptions{}, now);
    pump();
  }
  /// The login that waits is judged: alice gets in with the right password.
  void judge() {
    const auto requested = next_service<LoginRequested>();
    const auto* given = requested.attempt.credentials.find("password");
    if (requested.attempt.username == "alice" && given && *given == Value("secret"))
      service->answer_login(requested.id, AuthenticatedUser{"alice", {"objectlock"}, {}}, now);
    else
      service->answer_login(requested.id, make_error(ErrorCode::authentication_error, "Invalid username or password"),
                            now);
    pump();
  }
};

}  // namespace

TEST_CASE("a login within the combined request, and in the older sequence") {
  for (const auto& features : {Features{}, no_combined()}) {
    Guarded pair(true);
    pair.start(login("alice", password("secret"), features));
    CHECK_FALSE(pair.client->poll_event());
    if (!features.combined_v4) pair.next_service<ClientConnected>();
    pair.judge();
    pair.next_client<Connected>();
    if (features.combined_v4) pair.next_service<ClientConnected>();
    REQUIRE(pair.service->user() != nullptr);
    CHECK(pair.service->user()->name == "alice");
    const auto id = pair.client->get_property("arm", "speed", pair.now);
    pair.pump();
    pair.service->reply(pair.next_service<Called>().id, Value(1.5), pair.now);
    CHECK(pair.completion(id).value() == Value(1.5));
  }
}

TEST_CASE("a wrong password, an unknown user and no login at all end the same way") {
  for (const auto& [username, credentials] :
       {std::pair{"alice", password("wrong")}, std::pair{"mallory", password("secret")}, std::pair{"", Value{}},
        std::pair{"alice", Value{}}}) {
    Guarded pair(true);
    pair.start(login(username, credentials));
    if (!credentials.is_null()) pair.judge();
    const auto closed = pair.next_client<SessionClosed>();
    CHECK(closed.reason.code == ErrorCode::authentication_error);
    CHECK(closed.reason.message == "connect to 'arm': Authentication Failed");
    CHECK(pair.service->service() == nullptr);
  }
}

TEST_CASE("a name without credentials is no login: where none is needed, it connects") {
  Guarded pair(false);
  pair.start(login("alice", {}));
  pair.next_client<Connected>();
  CHECK(pair.service->user() == nullptr);
}

TEST_CASE("a login that nobody can judge fails as a connection does, and is no guess") {
  const auto away = make_error(ErrorCode::connection_error, "the device is away");
  Guarded pair(true);
  pair.start(login("alice", password("secret")));
  pair.service->answer_login(pair.next_service<LoginRequested>().id, away, pair.now);
  pair.pump();
  const auto closed = pair.next_client<SessionClosed>();
  CHECK(closed.reason.code == ErrorCode::connection_error);
  CHECK(closed.reason.message == "connect to 'arm': the device is away");

  Guarded later(false);
  later.start(login("", {}));
  later.next_client<Connected>();
  later.next_service<ClientConnected>();
  for (int attempt = 0; attempt < 10; ++attempt) {
    const auto id = later.client->authenticate("alice", password("secret"), later.now);
    later.pump();
    later.service->answer_login(later.next_service<LoginRequested>().id, away, later.now);
    later.pump();
    CHECK(later.completion(id).error().code == ErrorCode::connection_error);
  }
  CHECK_FALSE(later.service->wants_close());
}

TEST_CASE("a wrong password in the older sequence") {
  Guarded pair(true);
  pair.start(login("alice", password("wrong"), no_combined()));
  pair.next_service<ClientConnected>();
  pair.judge();
  CHECK(pair.next_client<SessionClosed>().reason.message == "connect to 'arm': Invalid username or password");
}

TEST_CASE("the combined request logs in only where a user is required, as at the reference") {
  Guarded pair(false);
  pair.start(login("alice", password("secret")));
  CHECK(pair.next_client<SessionClosed>().reason.code == ErrorCode::authentication_error);
  CHECK_FALSE(pair.service->poll_event());
}

TEST_CASE("log in later, as somebody else, and out") {
  Guarded pair(false);
  pair.start(login("", {}));
  pair.next_client<Connected>();
  pair.next_service<ClientConnected>();
  CHECK(pair.service->user() == nullptr);
  auto id = pair.client->authenticate("alice", password("secret"), pair.now);
  pair.pump();
  pair.judge();
  CHECK(pair.completion(id).value().is_null());
  CHECK(pair.service->user()->name == "alice");

  // A failed login leaves the one before.
  id = pair.client->authenticate("alice", password("wrong"), pair.now);
  pair.pump();
  pair.judge();
  CHECK(pair.completion(id).error().message == "Invalid username or password");
  CHECK(pair.service->user()->name == "alice");

  CHECK(pair.completion(pair.client->logout(pair.now)).value().is_null());
  CHECK(pair.service->user() == nullptr);
  CHECK(pair.completion(pair.client->authenticate("alice", Value(1.0), pair.now)).error().code ==
        ErrorCode::invalid_argument);
}

TEST_CASE("one login of a client at a time") {
  Guarded pair(false);
  pair.start(login("", {}));
  pair.next_client<Connected>();
  pair.next_service<ClientConnected>();
  const auto first = pair.client->authenticate("alice", password("secret"), pair.now);
  pair.pump();
  const auto second = pair.client->authenticate("alice", password("secret"), pair.now);
  CHECK(pair.completion(second).error().code == ErrorCode::member_busy);
  pair.judge();
  CHECK(pair.completion(first));
}

TEST_CASE("a client that still has to log in can do that, and nothing else") {
  Guarded pair(true);
  // The older sequence connects before it logs in: the client is made to stop there.
  pair.start(login("alice", password("secret"), no_combined()));
  pair.next_service<ClientConnected>();
  auto& connection = const_cast<Connection&>(pair.client->connection());
  const auto ask = [&](EntryType type, std::string_view path, std::string_view member) {
    Message message;
    connection.begin_message(message);
    message.begin_entry(type, path, member, 999);
    REQUIRE(connection.send(message, pair.now));
    Bytes bytes;
    for (const auto slice : pair.client->poll_transmit()) bytes.insert(bytes.end(), slice.begin(), slice.end());
    pair.client->handle_transmitted(bytes.size(), pair.now);
    pair.service->handle_bytes(bytes, pair.now);
    Bytes answer;
    for (const auto slice : pair.service->poll_transmit()) answer.insert(answer.end(), slice.begin(), slice.end());
    pair.service->handle_transmitted(answer.size(), pair.now);
    if (answer.empty()) return std::optional<Error>();
    Message reply;
    REQUIRE(decode(answer, {.string_table = connection.features().string_table}, reply));
    return std::optional(read_error(reply, reply.entries.front(), TypeRegistry{}));
  };
  for (const auto type :
       {EntryType::property_get_req, EntryType::property_set_req, EntryType::function_call_req,
        EntryType::wire_connect_req, EntryType::wire_peek_in_value_req, EntryType::service_check_capability_req,
        EntryType::memory_read, EntryType::pipe_connect_req, EntryType::generator_next_req}) {
    INFO(static_cast<int>(type));
    const auto error = ask(type, "arm", "speed");
    REQUIRE(error);
    CHECK(error->code == ErrorCode::authentication_error);
    CHECK(error->message == "User is not authenticated");
  }
  CHECK(ask(EntryType::object_type_name, "arm.tool", "")->code == ErrorCode::authentication_error);
  CHECK(ask(EntryType::client_session_op_req, "arm", "MonitorExit")->code == ErrorCode::authentication_error);
  CHECK(ask(EntryType::client_keep_alive_req, "arm", "")->code == ErrorCode::none);
  CHECK(ask(EntryType::endpoint_check_capability, "", "cap")->code == ErrorCode::none);
  CHECK(ask(EntryType::client_session_op_req, "arm", "Anything")->code == ErrorCode::protocol_error);
  CHECK_FALSE(ask(EntryType::wire_packet, "arm", "torque"));

  const auto& bumped = *pair.service->service()->root_type().find_member("bumped");
  const std::vector<Value> arguments{Value(std::int32_t{1}), Value("wall")};
  REQUIRE(pair.service->send_event("arm", bumped, arguments, pair.now));
  CHECK(pair.service->poll_transmit().empty());
  pair.judge();
  pair.next_client<Connected>();
  REQUIRE(pair.service->send_event("arm", bumped, arguments, pair.now));
  CHECK_FALSE(pair.service->poll_transmit().empty());
}

TEST_CASE("before the login the small limit for messages also bounds what string codes stand for") {
  for (const std::size_t maps : {4, 5}) {
    Guarded pair(true);
    pair.start(login("alice", password("secret"), no_combined()));
    pair.next_service<ClientConnected>();
    pair.next_service<LoginRequested>();
    // Each map names 250 kB twice; 4 * 512 KiB are allowed.
    pair.service->handle_bytes(coded_message(std::string(250'000, 'a'), coded_map(coded_element(), 1), maps), pair.now);
    CHECK(pair.service->wants_close() == (maps > 4));
    if (maps > 4)
      CHECK(pair.next_service<ClientGone>().reason.message.find(
                "the texts behind string codes are more than 2097152") != std::string::npos);
  }
}

TEST_CASE("notices of the service are for those who have logged in") {
  Guarded pair(true);
  pair.start(login("alice", password("secret"), no_combined()));
  pair.next_service<ClientConnected>();
  const bool has_logged_in = GENERATE(false, true);
  if (has_logged_in) {
    pair.judge();
    pair.next_client<Connected>();
  }
  pair.service->release_path("arm.tool", pair.now);
  CHECK(pair.service->poll_transmit().empty() == !has_logged_in);
  pair.pump();
  pair.service->close_service(pair.now);
  CHECK(pair.service->poll_transmit().empty() == !has_logged_in);
  pair.advance(std::chrono::milliseconds(100));
  pair.service->handle_timeout(pair.now);
  CHECK(pair.service->wants_close());
}

TEST_CASE("callbacks are for those who have logged in") {
  Guarded pair(true);
  pair.start(login("alice", password("secret"), no_combined()));
  pair.next_service<ClientConnected>();
  const auto& notice = *pair.service->service()->root_type().find_member("notice");
  const auto call = [&] {
    return pair.service->call_callback("arm", notice, std::vector<Value>{Value(std::int32_t{1})}, pair.now);
  };
  const auto expect_refused = [&] {
    const auto called = call();
    REQUIRE_FALSE(called);
    CHECK(called.error().code == ErrorCode::authentication_error);
    CHECK(called.error().message == "callback 'notice': the client has not logged in");
    CHECK(pair.service->poll_transmit().empty());
  };
  expect_refused();
  pair.judge();
  pair.next_client<Connected>();
  CHECK(call());
  pair.pump();
  pair.next_client<CallbackCalled>();
  CHECK(pair.completion(pair.client->logout(pair.now)));
  expect_refused();
}

TEST_CASE("whoever logs out of a service that requires a user has nothing connected any more") {
  Guarded pair(true);
  pair.start(login("alice", password("secret")));
  pair.judge();
  pair.next_client<Connected>();
  pair.next_service<ClientConnected>();
  const auto wire = pair.client->connect_wire("arm", "torque", pair.now);
  CHECK(pair.completion(wire));
  pair.next_service<WireConnected>();
  const auto pipe = pair.client->connect_pipe("arm", "samples", -1, pair.now);
  pair.pump();
  const auto connected = pair.next_service<PipeConnected>();
  pair.service->accept_pipe(connected.id, pair.now);
  CHECK(pair.completion(pipe));
  CHECK(pair.completion(pair.client->logout(pair.now)));
  CHECK(pair.next_service<PipeClosed>().id == connected.id);
  CHECK_FALSE(pair.service->has_wire("arm", "torque"));
  CHECK_FALSE(pair.service->send_pipe_packet(connected.id, Value(1.0), pair.now));
  const auto& torque = *pair.service->service()->root_type().find_member("torque");
  REQUIRE(pair.service->send_wire("arm", torque, Value(1.0), pair.now));
  CHECK(pair.service->poll_transmit().empty());
}

TEST_CASE("guessing ends: a connection is closed, then the service waits") {
  Guarded pair(false);
  pair.start(login("", {}));
  pair.next_client<Connected>();
  pair.next_service<ClientConnected>();
  for (int attempt = 0; attempt < 5; ++attempt) {
    const auto id = pair.client->authenticate("alice", password("guess"), pair.now);
    pair.pump();
    pair.judge();
    CHECK(pair.completion(id).error().code == ErrorCode::authentication_error);
  }
  CHECK(pair.next_service<ClientGone>().reason.message == "too many logins of this client have failed");
  pair.advance(std::chrono::milliseconds(101));
  pair.service->handle_timeout(pair.now);
  CHECK(pair.service->wants_close());

  Guarded strict(true);
  for (int connection = 0; connection < 60; ++connection) {
    strict.start(login("alice", password("guess")));
    strict.judge();
  }
  strict.start(login("alice", password("secret")));
  CHECK(strict.next_client<SessionClosed>().reason.message ==
        "connect to 'arm': too many logins have failed; try again later");
  strict.advance(std::chrono::seconds(1));
  strict.start(login("alice", password("secret")));
  strict.judge();
  strict.next_client<Connected>();
}

TEST_CASE("a client that goes while its login is judged leaves nothing behind") {
  Guarded pair(true);
  for (int i = 0; i < 100; ++i) {  // more than may be judged at once
    pair.start(login("alice", password("secret")));
    const auto requested = pair.next_service<LoginRequested>();
    pair.service->handle_closed({ErrorCode::connection_error, "gone"}, pair.now);
    pair.next_service<ClientGone>();
    pair.service->answer_login(requested.id, AuthenticatedUser{"alice", {}, {}}, pair.now);
    CHECK_FALSE(pair.service->poll_event());
    CHECK(pair.service->user() == nullptr);
  }
  std::vector<LoginRequested> judged;
  std::vector<std::unique_ptr<ServiceSession>> sessions;
  for (int i = 0; i < 64; ++i) {
    pair.start(login("alice", password("secret")));
    judged.push_back(pair.next_service<LoginRequested>());
    sessions.push_back(std::move(pair.service));
  }
  pair.start(login("alice", password("secret")));
  CHECK(pair.next_client<SessionClosed>().reason.code == ErrorCode::out_of_system_resource);
}

TEST_CASE("no secret is in the texts of a login") {
  Guarded pair(true);
  auto options = login("alice", Value("secret"));  // not even a map
  pair.start(std::move(options));
  const auto requested = pair.next_service<LoginRequested>();
  CHECK(requested.attempt.credentials.items.empty());
  pair.service->answer_login(requested.id, make_error(ErrorCode::internal_error, "secret backend detail"), pair.now);
  pair.pump();
  CHECK(pair.next_client<SessionClosed>().reason.message == "connect to 'arm': Authentication Failed");
}

TEST_CASE("the message size limit rises with the login, not with the session") {
  Guarded pair(true);
  pair.start(login("alice", password("secret"), no_combined()));
  pair.next_service<ClientConnected>();
  Message message;
  auto& connection = const_cast<Connection&>(pair.client->connection());
  connection.begin_message(message);
  message.begin_entry(EntryType::property_set_req, "arm", "pose", 77);
  const std::vector<double> many(80'000);
  message.add("value", DataType::double_t, static_cast<std::uint32_t>(many.size()),
              {reinterpret_cast<const std::uint8_t*>(many.data()), many.size() * sizeof(double)});
  REQUIRE(connection.send(message, pair.now));
  pair.pump();
  pair.next_service<LoginRequested>();
  CHECK(pair.next_service<ClientGone>().reason.code == ErrorCode::protocol_error);
}

TEST_CASE("a second session on one connection is refused, the first lives") {
  Loopback pair;
  pair.connect();
  auto& connection = const_cast<Connection&>(pair.client->connection());
  Message message;
  connection.begin_message(message);
  message.header.receiver_endpoint = 0;
  message.begin_entry(EntryType::connect_client, "arm", {}, 4711);
  REQUIRE(connection.send(message, pair.now));
  pair.pump();
  CHECK_FALSE(pair.service->wants_close());
  const auto id = pair.client->get_property("arm", "speed", pair.now);
  pair.pump();
  pair.service->reply(pair.next_service<Called>().id, Value(1.0), pair.now);
  CHECK(pair.completion(id));
}

TEST_CASE("whoever is let in when the service has been withdrawn joins neither it nor its successor") {
  const bool has_successor = GENERATE(false, true);
  Guarded pair(true);
  pair.start(login("alice", password("secret")));
  const auto requested = pair.next_service<LoginRequested>();
  REQUIRE(pair.directory.remove("arm"));
  if (has_successor) {
    auto types = std::make_shared<TypeRegistry>();
    types->add({definition}, RobdefMode::strict).value();
    pair.directory.add(HostedService::make("arm", pair.root, types, {}).value()).value();
  }
  pair.service->answer_login(requested.id, AuthenticatedUser{"alice", {}, {}}, pair.now);
  pair.pump();
  CHECK(pair.next_client<SessionClosed>().reason.code == ErrorCode::service_not_found);
  CHECK(pair.service->service() == nullptr);
  CHECK_FALSE(pair.service->poll_event());
}
