// Client and service sessions against each other: what a request becomes on the other side, and its answer back.
#include <catch2/catch.hpp>

#include <algorithm>

#include "test/core/session/loopback.hpp"
#include "test/support/print.hpp"

using namespace rr;
using namespace rr::test;

namespace {

const Features v2_only = [] {
  Features features;
  features.v4 = false;
  return features;
}();
const Features v4_plain = [] {
  Features features;
  features.string_table = {.local = false, .standard = false};
  return features;
}();
const Features no_combined = [] {
  Features features;
  features.combined_v2 = features.combined_v4 = false;
  return features;
}();

Value pose(double x) {
  return Structure{"experimental.loopback.Pose", {{"x", Value(x)}, {"joints", Value(std::vector<double>{1, 2, 3})}}};
}

/// A request of about 16 kB, which stays queued.
Bytes encoded_pose(Loopback& pair) {
  const Structure large{"experimental.loopback.Pose",
                        {{"x", Value(1.0)}, {"joints", Value(std::vector<double>(2000))}}};
  pair.client->set_property("arm", "pose", Value(large), pair.now);
  Bytes bytes;
  for (const auto slice : pair.client->poll_transmit()) bytes.insert(bytes.end(), slice.begin(), slice.end());
  return bytes;
}

}  // namespace

TEST_CASE("a session is set up in every combination of features, fed byte by byte") {
  const Features each[] = {{}, v4_plain, v2_only, no_combined};
  for (const auto& own : each)
    for (const auto& theirs : each) {
      Loopback pair(own, theirs);
      pair.pump(1);
      REQUIRE(pair.next_client<Connected>().object_type == "experimental.loopback.Arm");
      REQUIRE(pair.next_service<ClientConnected>().service->name() == "arm");
      CHECK(pair.client->connection().features() == pair.service->connection().features());
      CHECK(pair.client->connection().features().v4 == (own.v4 && theirs.v4));
      CHECK(pair.client->connection().peer() == NodeIdentity{service_id, "test.service"});
      CHECK(pair.client->attributes().find("location")->to_text().value() == "bench");
      REQUIRE(pair.client->object_type("arm") != nullptr);
    }
}

TEST_CASE("an unknown service is refused with its name") {
  Loopback pair;
  ClientOptions options;
  options.connection.self = {client_id, ""};
  options.service = "leg";
  pair.client = std::make_unique<ClientSession>(options, pair.now);
  pair.pump();
  const auto closed = pair.next_client<SessionClosed>();
  CHECK(closed.reason.code == ErrorCode::service_not_found);
  CHECK(closed.reason.message == "connect to 'leg': Service not found");
  CHECK(pair.client->wants_close());
}

TEST_CASE("a session that fails completes no request that nobody made") {
  Loopback pair(no_combined);
  const bool is_connected = GENERATE(false, true);
  if (is_connected) {
    pair.connect();
    pair.client->disconnect(pair.now);
  } else {
    pair.carry(*pair.client, *pair.service, 1u << 20);
    pair.carry(*pair.service, *pair.client, 1u << 20);
    CHECK(pair.client->pending_requests() == 1);
  }
  pair.client->handle_closed({ErrorCode::connection_error, "gone"}, pair.now);
  CHECK(pair.next_client<SessionClosed>().reason.message == "gone");
  CHECK_FALSE(pair.client->poll_event());
}

TEST_CASE("the reply to a connect connects no wire that was asked for after it") {
  Loopback pair;
  pair.connect();
  const auto* torque = pair.client->object_type("arm")->find_member("torque");
  const auto first = pair.client->connect_wire("arm", "torque", pair.now);
  pair.carry(*pair.client, *pair.service, 1u << 20);
  pair.next_service<WireConnected>();
  REQUIRE(pair.service->send_wire("arm", *torque, Value(1.0), pair.now));
  pair.client->disconnect_wire("arm", "torque", pair.now);
  const auto second = pair.client->connect_wire("arm", "torque", pair.now);
  pair.carry(*pair.service, *pair.client, 1u << 20);
  CHECK(pair.next_client<Completed>().id == first);
  CHECK_FALSE(pair.client->poll_event());
  pair.pump();
  pair.next_client<Completed>();
  CHECK(pair.next_client<Completed>().id == second);
  CHECK(pair.client->send_wire("arm", "torque", Value(2.0), pair.now));
}

TEST_CASE("the end of a wire's connection is not the end of the next one") {
  Loopback pair;
  pair.connect();
  const auto* torque = pair.client->object_type("arm")->find_member("torque");
  CHECK(pair.completion(pair.client->connect_wire("arm", "torque", pair.now)));
  pair.service->close_wire("arm", *torque, pair.now);
  pair.client->disconnect_wire("arm", "torque", pair.now);
  const auto again = pair.client->connect_wire("arm", "torque", pair.now);
  pair.pump();
  CHECK(pair.next_client<Completed>().result.error().message == "Invalid wire connection");
  CHECK(pair.next_client<Completed>().id == again);
  CHECK(pair.client->send_wire("arm", "torque", Value(2.0), pair.now));
}

TEST_CASE("the wrong node is refused by the service") {
  Loopback pair;
  ClientOptions options;
  options.connection.self = {client_id, ""};
  options.connection.target = {NodeId{{9}}, ""};
  options.service = "arm";
  pair.client = std::make_unique<ClientSession>(options, pair.now);
  pair.pump();
  CHECK(pair.next_client<SessionClosed>().reason.code == ErrorCode::node_not_found);
}

TEST_CASE("a client that is known by its certificate speaks for itself alone") {
  Loopback pair;
  ServiceSessionOptions options;
  options.connection.known_peer = GENERATE(as<NodeId>{}, client_id, NodeId{{9}});
  const bool is_itself = options.connection.known_peer == client_id;
  pair.service = std::make_unique<ServiceSession>(pair.directory, options, pair.now);
  pair.pump();
  if (!is_itself) {
    CHECK(pair.next_client<SessionClosed>().reason.code == ErrorCode::node_not_found);
    return;
  }
  pair.next_client<Connected>();
  pair.next_service<ClientConnected>();
  pair.forge(*pair.client, [](Message& message) {
    message.begin_entry(EntryType::client_keep_alive_req, "arm", {}, 77);
    message.header.receiver_node_id = NodeId{{8}};  // so that addresses are written
  });
  Bytes bytes;
  for (const auto slice : pair.client->poll_transmit()) bytes.insert(bytes.end(), slice.begin(), slice.end());
  const auto at = std::search(bytes.begin(), bytes.end(), client_id.bytes.begin(), client_id.bytes.end());
  REQUIRE(at != bytes.end());
  *at = 0xee;
  pair.service->handle_bytes(bytes, pair.now);
  CHECK(pair.service->wants_close());
  CHECK_THAT(pair.service->connection().close_reason().message, Catch::Contains("a message of node {eeaaaaaa-0100"));
}

TEST_CASE("a service that is known by its certificate needs no name, but its id") {
  Loopback pair;
  const bool is_expected = GENERATE(true, false);
  ClientOptions options;
  options.connection.self = {client_id, ""};
  options.connection.known_peer = is_expected ? service_id : NodeId{{9}};
  options.service = "arm";
  pair.client = std::make_unique<ClientSession>(options, pair.now);
  pair.pump();
  if (is_expected)
    CHECK_NOTHROW(pair.next_client<Connected>());
  else
    CHECK_THAT(pair.next_client<SessionClosed>().reason.message, Catch::Contains("wrong node"));
}

TEST_CASE("STARTTLS where it can't be done any more") {
  Loopback pair;
  const auto ask = [](Message& message) { message.begin_entry(EntryType::stream_op, {}, "STARTTLS"); };
  pair.connect();
  CHECK(pair.answer_to(ask).message == "Server certificate not loaded");
  ServiceSessionOptions options;
  options.connection.is_encrypted = true;
  Loopback encrypted;
  encrypted.service = std::make_unique<ServiceSession>(encrypted.directory, options, encrypted.now);
  encrypted.connect();
  CHECK(encrypted.answer_to(ask).message == "Invalid Stream Operation");
}

TEST_CASE("properties are read and written, directions hold on both sides") {
  Loopback pair;
  pair.connect();
  auto id = pair.client->set_property("arm", "speed", Value(2.5), pair.now);
  pair.pump();
  auto called = pair.next_service<Called>();
  CHECK(called.kind == CallKind::property_set);
  CHECK(called.member->name == "speed");
  CHECK(called.object == pair.root);
  CHECK(called.arguments == std::vector<Value>{Value(2.5)});
  pair.service->reply(called.id, Value{}, pair.now);
  CHECK(pair.completion(id).value().is_null());

  id = pair.client->get_property("arm", "pose", pair.now);
  pair.pump();
  called = pair.next_service<Called>();
  CHECK(called.kind == CallKind::property_get);
  pair.service->reply(called.id, pose(4), pair.now);
  CHECK(pair.completion(id).value() == pose(4));

  CHECK(pair.completion(pair.client->set_property("arm", "serial", Value(1), pair.now)).error().code ==
        ErrorCode::read_only_member);
  CHECK(pair.completion(pair.client->get_property("arm", "secret", pair.now)).error().code ==
        ErrorCode::write_only_member);
  CHECK(pair.completion(pair.client->get_property("arm", "nothing", pair.now)).error().code ==
        ErrorCode::member_not_found);
  CHECK(pair.completion(pair.client->get_property("arm", "add", pair.now)).error().code == ErrorCode::member_not_found);
}

TEST_CASE("functions take arguments and return values or errors") {
  Loopback pair;
  pair.connect();
  const std::vector<Value> arguments{Value(2.0), Value(3.0)};
  auto id = pair.client->call_function("arm", "add", arguments, pair.now);
  pair.pump();
  auto called = pair.next_service<Called>();
  CHECK(called.arguments == arguments);
  pair.service->reply(called.id, Value(5.0), pair.now);
  CHECK(pair.completion(id).value() == Value(5.0));

  id = pair.client->call_function("arm", "jam", {}, pair.now);
  pair.pump();
  called = pair.next_service<Called>();
  Error jammed{ErrorCode::remote_error, "joint 3", "experimental.loopback.ArmJammed", "elbow"};
  jammed.param = std::make_shared<const Value>(Array::take(std::vector<std::int32_t>{3}));
  pair.service->reply(called.id, jammed, pair.now);
  const auto failed = pair.completion(id).error();
  CHECK(failed.code == ErrorCode::remote_error);
  CHECK(failed.qualified_name() == "experimental.loopback.ArmJammed");
  CHECK(failed.message == "joint 3");
  CHECK(failed.sub_name == "elbow");
  REQUIRE(failed.param);
  CHECK(failed.param->to<std::int32_t>().value() == 3);

  SECTION("a handler's value that does not fit the definition is the caller's error, not silence") {
    id = pair.client->call_function("arm", "add", arguments, pair.now);
    pair.pump();
    pair.service->reply(pair.next_service<Called>().id, Value("five"), pair.now);
    CHECK(pair.completion(id).error().code == ErrorCode::data_type_mismatch);
  }
  SECTION("the number of arguments is checked before anything is sent") {
    CHECK(pair.completion(pair.client->call_function("arm", "add", {}, pair.now)).error().message ==
          "function 'add': 0 arguments given, 2 expected");
  }
}

TEST_CASE("a reply without a call, a late one and a repeated one are ignored") {
  Loopback pair;
  pair.connect();
  const auto id = pair.client->get_property("arm", "speed", pair.now);
  pair.pump();
  const auto called = pair.next_service<Called>();
  pair.advance(std::chrono::seconds(16));
  pair.client->handle_timeout(pair.now);
  const auto done = pair.next_client<Completed>();
  CHECK(done.id == id);
  CHECK(done.result.error().code == ErrorCode::request_timeout);
  CHECK(done.result.error().message == "no answer from 'speed' in time");
  pair.service->reply(called.id, Value(1.0), pair.now);
  pair.service->reply(called.id, Value(1.0), pair.now);
  pair.service->reply(12345, Value(1.0), pair.now);
  pair.pump();
  CHECK_FALSE(pair.client->poll_event());
  CHECK(pair.client->state() == ClientState::connected);
}

TEST_CASE("events reach the client with their arguments") {
  Loopback pair;
  pair.connect();
  const auto& bumped = *pair.service->service()->root_type().find_member("bumped");
  const std::vector<Value> arguments{Value(std::int32_t{-1}), Value("wall")};
  REQUIRE(pair.service->send_event("arm", bumped, arguments, pair.now));
  pair.pump();
  const auto event = pair.next_client<EventReceived>();
  CHECK(event.path == "arm");
  CHECK(event.member == "bumped");
  CHECK(event.arguments == arguments);
}

TEST_CASE("one packet of an event serves all clients, each as it speaks, encoded once") {
  std::vector<std::unique_ptr<Loopback>> pairs;
  for (const auto& features :
       {Features{}, Features{}, Features{.string_table = {.local = false, .standard = false}}, legacy_features})
    pairs.emplace_back(std::make_unique<Loopback>(features))->connect();
  CHECK_FALSE(pairs.back()->client->connection().features().v4);
  const auto& bumped = *pairs.front()->service->service()->root_type().find_member("bumped");
  const auto fire = [&](std::int32_t then) {
    std::vector<Value> arguments{Value(std::int32_t{1}), Value("wall")};
    EventPacket packet("arm", bumped, arguments);
    for (const auto& pair : pairs) {
      REQUIRE(pair->service->send_event(packet, pair->now));
      arguments.front() = Value(then);
      pair->pump();
    }
  };
  fire(1);
  for (const auto& pair : pairs)
    CHECK(pair->next_client<EventReceived>().arguments == std::vector<Value>{Value(std::int32_t{1}), Value("wall")});
  fire(2);
  const auto first_of = [](Loopback& pair) {
    return pair.next_client<EventReceived>().arguments.front().to<std::int32_t>().value();
  };
  CHECK(first_of(*pairs[0]) == 1);
  CHECK(first_of(*pairs[1]) == 1);  // what the first one was sent
  CHECK(first_of(*pairs[2]) == 2);
  CHECK(first_of(*pairs[3]) == 2);
}

TEST_CASE("an event that does not fit its definition goes to nobody") {
  Loopback pair;
  pair.connect();
  const std::vector<Value> arguments{Value("one"), Value("wall")};
  EventPacket packet("arm", *pair.service->service()->root_type().find_member("bumped"), arguments);
  for (int i = 0; i < 2; ++i) {
    const auto sent = pair.service->send_event(packet, pair.now);
    REQUIRE_FALSE(sent);
    CHECK(sent.error().code == ErrorCode::data_type_mismatch);
  }
  CHECK(pair.service->poll_transmit().empty());
}

TEST_CASE("a service knows the paths of each object, until they are released or make room for others") {
  Loopback pair;
  auto& service = *pair.directory.find("arm");
  const auto tool = std::make_shared<PlainObject>("experimental.loopback.Tool");
  const auto other = std::make_shared<PlainObject>("experimental.loopback.Tool");
  REQUIRE(service.add_object("arm.tools[2]", tool));
  REQUIRE(service.add_object("arm.tool", tool));
  REQUIRE(service.add_object("arm.tool.sensor", other));
  CHECK(service.paths_of(*tool) == std::vector<std::string>{"arm.tool", "arm.tools[2]"});
  REQUIRE(service.add_object("arm.tool", other));
  CHECK(service.paths_of(*tool) == std::vector<std::string>{"arm.tools[2]"});
  CHECK(service.paths_of(*other) == std::vector<std::string>{"arm.tool", "arm.tool.sensor"});
  CHECK(service.forget_path("arm.tool"));
  CHECK_FALSE(service.forget_path("arm.tool"));
  CHECK(service.paths_of(*other).empty());
  CHECK(service.paths_of(*tool) == std::vector<std::string>{"arm.tools[2]"});
  for (int i = 0; i < 5000; ++i) REQUIRE(service.add_object("arm.tools[" + std::to_string(i) + "]", other));
  CHECK(service.paths_of(*tool).empty());
  CHECK(service.paths_of(*other).size() == 4095);  // the root stays
}

TEST_CASE("objrefs are looked up once, with their index escaped") {
  Loopback pair;
  pair.connect();
  const std::string path = child_path("arm", "tools", "left-claw");
  CHECK(path == "arm.tools[left%2dclaw]");
  CHECK(pair.completion(pair.client->find_object(path, pair.now)).value() == Value("experimental.loopback.Tool"));
  CHECK(pair.root->asked == std::vector<std::string>{"tools[left-claw]"});
  CHECK(pair.client->object_type(path)->name == "Tool");
  CHECK(pair.completion(pair.client->find_object(path, pair.now)).value() == Value("experimental.loopback.Tool"));
  CHECK(pair.root->asked.size() == 1);

  const auto id = pair.client->get_property(path, "name", pair.now);
  pair.pump();
  pair.service->reply(pair.next_service<Called>().id, Value("claw"), pair.now);
  CHECK(pair.completion(id).value() == Value("claw"));

  CHECK(pair.completion(pair.client->find_object("arm.nothing", pair.now)).error().code == ErrorCode::member_not_found);
  CHECK(pair.completion(pair.client->find_object("arm.tools[none]", pair.now)).error().code ==
        ErrorCode::service_error);
  CHECK(pair.completion(pair.client->find_object("arm.slots[x]", pair.now)).error().code ==
        ErrorCode::invalid_argument);
  CHECK(pair.completion(pair.client->find_object("leg.tool", pair.now)).error().code == ErrorCode::object_not_found);
  CHECK(pair.completion(pair.client->find_object("arm..tool", pair.now)).error().code == ErrorCode::service_error);

  SECTION("a released path must be looked up again") {
    pair.service->service()->forget_path("arm.tools[left%2dclaw]");
    pair.service->release_path(path, pair.now);
    pair.pump();
    CHECK(pair.next_client<PathReleased>().path == path);
    CHECK(pair.client->object_type(path) == nullptr);
    CHECK(pair.client->object_type("arm") != nullptr);
    CHECK(pair.completion(pair.client->get_property(path, "name", pair.now)).error().code ==
          ErrorCode::object_not_found);
  }
}

TEST_CASE("wires carry the newest value both ways") {
  Loopback pair;
  pair.connect();
  const auto& torque = *pair.service->service()->root_type().find_member("torque");
  auto id = pair.client->connect_wire("arm", "torque", pair.now);
  CHECK(pair.completion(id).value().is_null());
  const auto connected = pair.next_service<WireConnected>();
  CHECK(connected.path == "arm");
  CHECK(pair.service->has_wire("arm", "torque"));

  REQUIRE(pair.service->send_wire("arm", torque, Value(1.5), pair.now));
  REQUIRE(pair.service->send_wire("arm", torque, Value(2.5), pair.now));
  pair.pump();
  const auto first = pair.next_client<WireValueReceived>();
  const auto second = pair.next_client<WireValueReceived>();
  CHECK(first.value == Value(1.5));
  CHECK(second.value == Value(2.5));
  CHECK(first.time < second.time);  // same clock reading, strictly later stamp

  REQUIRE(pair.client->send_wire("arm", "torque", Value(-1.0), pair.now));
  pair.pump();
  CHECK(pair.next_service<WireReceived>().value == Value(-1.0));

  id = pair.client->peek_in_value("arm", "torque", pair.now);
  pair.pump();
  auto called = pair.next_service<Called>();
  CHECK(called.kind == CallKind::peek_in);
  pair.service->reply(called.id, Value(9.0), pair.now);
  CHECK(pair.completion(id).value() == Value(9.0));

  id = pair.client->poke_out_value("arm", "torque", Value(7.0), pair.now);
  pair.pump();
  called = pair.next_service<Called>();
  CHECK(called.kind == CallKind::poke_out);
  CHECK(called.arguments.front() == Value(7.0));
  pair.service->reply(called.id, Value{}, pair.now);
  CHECK(pair.completion(id).value().is_null());

  CHECK_FALSE(pair.client->send_wire("arm", "state", pose(1), pair.now));
  CHECK(pair.completion(pair.client->poke_out_value("arm", "state", pose(1), pair.now)).error().code ==
        ErrorCode::read_only_member);
  CHECK(pair.completion(pair.client->disconnect_wire("arm", "torque", pair.now)).value().is_null());
  CHECK(pair.completion(pair.client->disconnect_wire("arm", "torque", pair.now)).error().code ==
        ErrorCode::service_error);
  CHECK_FALSE(pair.service->has_wire("arm", "torque"));
}

TEST_CASE("one packet of a wire serves all its clients, each as it speaks") {
  std::vector<std::unique_ptr<Loopback>> pairs;
  for (const auto& features :
       {Features{}, Features{}, Features{.string_table = {.local = false, .standard = false}}, legacy_features}) {
    auto& pair = *pairs.emplace_back(std::make_unique<Loopback>(features));
    pair.connect();
    pair.completion(pair.client->connect_wire("arm", "state", pair.now)).value();
    pair.next_service<WireConnected>();
  }
  pairs.push_back(std::make_unique<Loopback>());  // has not connected the wire
  pairs.back()->connect();
  const auto& state = *pairs.front()->service->service()->root_type().find_member("state");
  const auto send = [&](const Value& value, TimeSpec time) {
    WirePacket packet("arm", state, value, time, pairs.front()->now.steady);
    for (const auto& pair : pairs) REQUIRE(pair->service->send_wire(packet, pair->now));
    for (const auto& pair : pairs) pair->pump();
  };
  send(pose(1), {50, 1});
  send(pose(2), {50, 2});
  send(pose(3), {40, 0});  // the clock was set back
  pairs.pop_back();
  CHECK(pairs.front()->client->connection().features().v4);
  CHECK_FALSE(pairs.back()->client->connection().features().v4);
  for (const auto& pair : pairs) {
    for (std::int32_t i = 1; i <= 3; ++i) {
      const auto received = pair->next_client<WireValueReceived>();
      CHECK(received.value == pose(i));
      CHECK(received.time == TimeSpec{50, i});
    }
    CHECK_FALSE(pair->client->poll_event());
    CHECK(pair->service->total_ledgers().wires.delivered == 3);
  }
}

TEST_CASE("a value that does not fit its wire goes to nobody") {
  Loopback pair;
  pair.connect();
  pair.completion(pair.client->connect_wire("arm", "state", pair.now)).value();
  const auto& state = *pair.service->service()->root_type().find_member("state");
  const Value text("no pose");
  WirePacket packet("arm", state, text, {50, 1}, pair.now.steady);
  for (int i = 0; i < 2; ++i) {
    const auto sent = pair.service->send_wire(packet, pair.now);
    REQUIRE_FALSE(sent);
    CHECK(sent.error().code == ErrorCode::data_type_mismatch);
  }
  CHECK(pair.service->poll_transmit().empty());
  CHECK(pair.service->total_ledgers().wires.delivered == 0);
}

TEST_CASE("a slow stream replaces wire values instead of queueing them") {
  Loopback pair;
  pair.connect();
  const auto& state = *pair.service->service()->root_type().find_member("state");
  pair.completion(pair.client->connect_wire("arm", "state", pair.now)).value();
  pair.next_service<WireConnected>();
  const auto big = [](double x) {
    return Value(
        Structure{"experimental.loopback.Pose", {{"x", Value(x)}, {"joints", Value(std::vector<double>(10'000))}}});
  };
  for (int i = 0; i < 100; ++i) REQUIRE(pair.service->send_wire("arm", state, big(i), pair.now));
  CHECK(pair.service->connection().queued_bytes() < 200'000);
  pair.pump();
  Value last;
  int received = 0;
  while (auto event = pair.client->poll_event()) {
    last = std::get<WireValueReceived>(*event).value;
    ++received;
  }
  CHECK(received == 2);
  CHECK(last == big(99));
}

TEST_CASE("one client connects a bounded number of wires") {
  Loopback pair;
  ServiceSessionOptions options;
  options.max_wires = 1;
  pair.service = std::make_unique<ServiceSession>(pair.directory, options, pair.now);
  pair.connect();
  CHECK(pair.completion(pair.client->connect_wire("arm", "torque", pair.now)).has_value());
  CHECK(pair.completion(pair.client->connect_wire("arm", "state", pair.now)).error().code ==
        ErrorCode::out_of_system_resource);
  CHECK(pair.completion(pair.client->connect_wire("arm", "torque", pair.now)).has_value());
}

TEST_CASE("an endpoint is bound to its connection") {
  Loopback pair;
  pair.connect();
  // Another connection learns the endpoint's number and tries to act in the session.
  Loopback other;
  other.connect();
  auto& intruder = const_cast<Connection&>(other.client->connection());
  Message message;
  intruder.begin_message(message);
  message.header.receiver_endpoint = pair.client->connection().remote_endpoint();
  message.begin_entry(EntryType::function_call_req, "arm", "stop", 5);
  REQUIRE(intruder.send(message, other.now));
  Bytes bytes;
  for (const auto slice : other.client->poll_transmit()) bytes.insert(bytes.end(), slice.begin(), slice.end());
  other.service->handle_bytes(bytes, other.now);
  CHECK_FALSE(other.service->poll_event());
  Bytes answer;
  for (const auto slice : other.service->poll_transmit()) answer.insert(answer.end(), slice.begin(), slice.end());
  Message reply;
  REQUIRE(decode(answer, {.string_table = {true, true}}, reply));
  CHECK(reply.entries.front().error == ErrorCode::invalid_endpoint);
}

TEST_CASE("only the node that connected speaks in its session") {
  Loopback pair;
  pair.connect();
  const auto answer_to_keep_alive_of = [&](NodeId sender) {
    Message message;
    const_cast<Connection&>(pair.client->connection()).begin_message(message);
    message.header.sender_node_id = sender;
    message.begin_entry(EntryType::client_keep_alive_req, "arm", {}, 77);
    EncodedMessage encoded;
    encode(message, {}, encoded).value();
    pair.service->handle_bytes(encoded.to_bytes(), pair.now);
    Bytes bytes;
    for (const auto slice : pair.service->poll_transmit()) bytes.insert(bytes.end(), slice.begin(), slice.end());
    pair.service->handle_transmitted(bytes.size(), pair.now);
    Message reply;
    decode(bytes, {.string_table = {true, true}}, reply).value();
    return reply.entries.front().error;
  };
  CHECK(answer_to_keep_alive_of(client_id) == ErrorCode::none);
  CHECK(answer_to_keep_alive_of(NodeId{{9}}) == ErrorCode::invalid_endpoint);
}

TEST_CASE("an orderly goodbye, and a service that is closed") {
  Loopback pair;
  pair.connect();
  SECTION("the client disconnects") {
    pair.client->disconnect(pair.now);
    pair.pump();
    CHECK(pair.next_client<SessionClosed>().reason.message == "closed by this side");
    pair.next_service<ClientGone>();
    CHECK(pair.client->wants_close());
    CHECK_FALSE(pair.service->wants_close());  // lingers for its last reply
    pair.advance(std::chrono::milliseconds(101));
    pair.service->handle_timeout(pair.now);
    CHECK(pair.service->wants_close());
  }
  SECTION("the service closes: pending requests fail with ConnectionError") {
    const auto id = pair.client->get_property("arm", "speed", pair.now);
    pair.pump();
    pair.service->close_service(pair.now);
    pair.pump();
    const auto done = pair.next_client<Completed>();
    CHECK(done.id == id);
    CHECK(done.result.error().code == ErrorCode::connection_error);
    CHECK(pair.next_client<SessionClosed>().reason.message == "the service was closed");
  }
  SECTION("the stream is cut") {
    pair.client->handle_closed({ErrorCode::connection_error, "reset by peer"}, pair.now);
    CHECK(pair.next_client<SessionClosed>().reason.message == "reset by peer");
    CHECK(pair.completion(pair.client->get_property("arm", "speed", pair.now)).error().message == "reset by peer");
    pair.service->handle_closed({ErrorCode::connection_error, "reset by peer"}, pair.now);
    pair.next_service<ClientGone>();
    CHECK_FALSE(pair.service->poll_event());
  }
}

TEST_CASE("heartbeats keep an idle connection and end a dead one") {
  Loopback pair;
  pair.connect();
  for (int minute = 0; minute < 20; ++minute) {
    pair.advance(std::chrono::seconds(11));
    pair.client->handle_timeout(pair.now);
    pair.service->handle_timeout(pair.now);
    pair.pump();
  }
  CHECK(pair.client->state() == ClientState::connected);
  CHECK(pair.service->service() != nullptr);
  pair.advance(std::chrono::seconds(11));
  pair.client->handle_timeout(pair.now);  // sends a heartbeat that nobody answers
  pair.advance(std::chrono::seconds(14));
  pair.client->handle_timeout(pair.now);
  CHECK(pair.client->state() == ClientState::connected);
  pair.advance(std::chrono::seconds(1));
  pair.client->handle_timeout(pair.now);
  CHECK(pair.client->state() == ClientState::closed);
  CHECK(pair.next_client<SessionClosed>().reason.message == "the peer is silent: a heartbeat was not answered");
}

TEST_CASE("a large message that takes minutes to come is a sign of life all the while") {
  Loopback pair;
  pair.connect();
  const auto bytes = encoded_pose(pair);
  for (std::size_t at = 0; at < bytes.size(); at += 1000) {
    pair.advance(std::chrono::seconds(9));
    pair.service->handle_timeout(pair.now);
    REQUIRE(pair.service->service() != nullptr);
    pair.service->handle_bytes(ByteSpan(bytes).subspan(at, std::min<std::size_t>(1000, bytes.size() - at)), pair.now);
  }
  CHECK(pair.next_service<Called>().member->name == "pose");
}

TEST_CASE("a heartbeat behind a large message has time as long as the stream takes bytes") {
  Loopback pair;
  pair.connect();
  encoded_pose(pair);
  for (int i = 0; i < 12; ++i) {
    pair.advance(std::chrono::seconds(9));
    pair.client->handle_timeout(pair.now);
    REQUIRE(pair.client->state() == ClientState::connected);
    pair.client->handle_transmitted(1000, pair.now);
  }
  pair.advance(std::chrono::seconds(15));
  pair.client->handle_timeout(pair.now);
  CHECK(pair.client->state() == ClientState::closed);
}

TEST_CASE("who sends byte by byte has no longer to set up a connection") {
  Loopback pair;
  Bytes bytes;
  for (const auto slice : pair.client->poll_transmit()) bytes.insert(bytes.end(), slice.begin(), slice.end());
  for (std::size_t at = 0; at < 5; ++at) {
    CHECK_FALSE(pair.service->wants_close());
    pair.service->handle_bytes(ByteSpan(bytes).subspan(at, 1), pair.now);
    pair.advance(std::chrono::seconds(1));
    pair.service->handle_timeout(pair.now);
  }
  CHECK(pair.service->wants_close());
}

TEST_CASE("requests above the limit wait until others are answered, and nobody is to blame for the silence") {
  Loopback pair;
  ServiceSessionOptions options;
  options.max_open_calls = 4;
  pair.service = std::make_unique<ServiceSession>(pair.directory, options, pair.now);
  pair.connect();
  for (int i = 0; i < 10; ++i) pair.client->call_function("arm", "stop", {}, pair.now);
  Bytes bytes;
  for (const auto slice : pair.client->poll_transmit()) bytes.insert(bytes.end(), slice.begin(), slice.end());
  ByteSpan rest = bytes;
  rest = rest.subspan(pair.service->handle_bytes(rest, pair.now));
  REQUIRE_FALSE(rest.empty());
  CHECK(pair.service->handle_bytes(rest, pair.now) == 0);
  for (int i = 0; i < 10; ++i) {
    pair.advance(std::chrono::seconds(20));
    pair.service->handle_timeout(pair.now);
  }
  REQUIRE(pair.service->service() != nullptr);
  for (int i = 0; i < 10; ++i) {
    pair.service->reply(pair.next_service<Called>().id, Value{}, pair.now);
    rest = rest.subspan(pair.service->handle_bytes(rest, pair.now));
  }
  CHECK(rest.empty());
  pair.carry(*pair.service, *pair.client, bytes.size());
  for (int i = 0; i < 10; ++i) CHECK(pair.next_client<Completed>().result);
}

TEST_CASE("who has not logged in gets no more answers before the first ones are read") {
  Loopback pair;
  pair.lose_requests();
  for (int i = 0; i < 1000; ++i)
    pair.forge(*pair.client, [](Message& message) { message.begin_entry(EntryType::get_service_desc, "arm", {}, 1); });
  Bytes bytes;
  while (true) {
    const auto slices = pair.client->poll_transmit();
    if (slices.empty()) break;
    const auto before = bytes.size();
    for (const auto slice : slices) bytes.insert(bytes.end(), slice.begin(), slice.end());
    pair.client->handle_transmitted(bytes.size() - before, pair.now);
  }
  ByteSpan rest = bytes;
  std::size_t answers = 0;
  while (!rest.empty()) {
    const auto taken = pair.service->handle_bytes(rest, pair.now);
    CHECK(pair.service->queued_bytes() < 70'000);
    rest = rest.subspan(taken);
    CHECK(pair.service->held_bytes() == pair.service->queued_bytes());
    if (!rest.empty()) CHECK(pair.service->handle_bytes(rest, pair.now) == 0);
    std::size_t size = 0;
    for (const auto slice : pair.service->poll_transmit()) size += slice.size();
    answers += size;
    REQUIRE((taken > 0 || size > 0));
    pair.service->handle_transmitted(size, pair.now);
  }
  CHECK(answers > 1'000'000);
}

TEST_CASE("silence during set-up ends in time, on both sides") {
  Loopback pair;
  CHECK(pair.client->poll_timeout() - pair.now.steady == std::chrono::seconds(5));
  pair.advance(std::chrono::seconds(5));
  pair.client->handle_timeout(pair.now);
  CHECK(pair.next_client<SessionClosed>().reason.message == "the node did not answer CreateConnection in time");
  pair.service->handle_timeout(pair.now);
  CHECK(pair.next_service<ClientGone>().reason.message == "the client sent no message in time");
  CHECK(pair.service->wants_close());
}

TEST_CASE("garbage closes a service session and names the byte") {
  Loopback pair;
  const std::string garbage = "GARBAGE in, nothing out";
  pair.service->handle_bytes(as_bytes(garbage), pair.now);
  CHECK(pair.service->wants_close());
  CHECK(pair.next_service<ClientGone>().reason.code == ErrorCode::protocol_error);
}

TEST_CASE("the service index lists services with their URLs") {
  Loopback pair;
  ClientOptions options;
  options.connection.self = {client_id, ""};
  options.service = "RobotRaconteurServiceIndex";
  pair.client = std::make_unique<ClientSession>(options, pair.now);
  pair.pump();
  CHECK(pair.next_client<Connected>().object_type == "RobotRaconteurServiceIndex.ServiceIndex");
  const auto id = pair.client->call_function("RobotRaconteurServiceIndex", "GetLocalNodeServices", {}, pair.now);
  const auto answer = pair.completion(id).value();
  const auto* services = answer.get_if<MapInt32>();
  REQUIRE(services);
  REQUIRE(services->items.size() == 2);
  std::vector<std::string> names;
  for (const auto& [key, info] : services->items)
    names.emplace_back(info.get_if<Structure>()->find("Name")->to_text().value());
  CHECK(names == std::vector<std::string>{"arm", "RobotRaconteurServiceIndex"});
  const auto* arm = services->items[0].second.get_if<Structure>();
  CHECK(arm->find("RootObjectType")->to_text().value() == "experimental.loopback.Arm");
  const auto* urls = arm->find("ConnectionURL")->get_if<MapInt32>();
  CHECK(urls->items.front().first == 1);
  CHECK(urls->items.front().second.to_text().value() ==
        "rr+tcp://127.0.0.1:1/?nodeid=11111111-0200-0000-0000-000000000000&service=arm");
  const auto routed = pair.client->call_function("RobotRaconteurServiceIndex", "GetRoutedNodes", {}, pair.now);
  CHECK(pair.completion(routed).value().get_if<MapInt32>()->items.empty());
}

TEST_CASE("bases are named with their definition, local ones without, aliases never") {
  TypeRegistry types;
  types
      .add({"service x.base\nstdver 0.10\nobject Base\nend\n",
            "service x.top\nstdver 0.10\nimport x.base\nusing x.base.Base as B\nobject Local\nend\n"
            "object Top\nimplements B\nimplements Local\nend\n"},
           RobdefMode::strict)
      .value();
  const auto& top = *types.find_entity("x.top.Top");
  CHECK(implements_name(top, top.implements[0]) == "x.base.Base");
  CHECK(implements_name(top, top.implements[1]) == "Local");
}

TEST_CASE("messages above the limit are refused: before login 512 KiB, then the configured size") {
  Loopback pair;
  pair.connect();
  const auto big = [](std::size_t doubles) {
    return Value(
        Structure{"experimental.loopback.Pose", {{"x", Value(0.0)}, {"joints", Value(std::vector<double>(doubles))}}});
  };
  auto id = pair.client->set_property("arm", "pose", big(1'000'000), pair.now);
  pair.pump();
  pair.service->reply(pair.next_service<Called>().id, Value{}, pair.now);
  CHECK(pair.completion(id));
  CHECK(pair.completion(pair.client->set_property("arm", "pose", big(1'600'000), pair.now)).error().code ==
        ErrorCode::protocol_error);
  id = pair.client->get_property("arm", "pose", pair.now);
  pair.pump();
  pair.service->reply(pair.next_service<Called>().id, big(1'600'000), pair.now);
  CHECK(pair.completion(id).error().code == ErrorCode::protocol_error);
  CHECK(pair.client->state() == ClientState::connected);
}

TEST_CASE("who is not wanted hears why, whichever way he connects, and the session ends behind it") {
  Features features;
  const bool is_stepwise = GENERATE(false, true);
  if (is_stepwise) features.combined_v2 = features.combined_v4 = false;
  Loopback pair(features);
  ServiceSessionOptions options;
  options.refusal = make_error(ErrorCode::permission_denied, "not you");
  pair.service = std::make_unique<ServiceSession>(pair.directory, options, pair.now);
  pair.pump();
  const auto closed = pair.next_client<SessionClosed>();
  CHECK(closed.reason.code == ErrorCode::permission_denied);
  CHECK(closed.reason.message == "connect to 'arm': not you");
  pair.next_service<ClientGone>();
  CHECK_FALSE(pair.service->wants_close());
  pair.now.steady = pair.service->poll_timeout();
  pair.service->handle_timeout(pair.now);
  CHECK(pair.service->wants_close());
}
