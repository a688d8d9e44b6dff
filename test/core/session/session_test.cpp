// How a session of a client with a service is set up, who speaks in it, what it is refused for, and how it ends.
#include <catch2/catch.hpp>

#include "core/session/service/service_index.hpp"
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

TEST_CASE("the definition of the service index is read once for all nodes") {
  const ServiceDirectory one({service_id, "one"});
  const ServiceDirectory other({client_id, "other"});
  CHECK(one.find(service_index_name)->shared_types() == other.find(service_index_name)->shared_types());
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
        ErrorCode::buffer_limit_violation);
  id = pair.client->get_property("arm", "pose", pair.now);
  pair.pump();
  pair.service->reply(pair.next_service<Called>().id, big(1'600'000), pair.now);
  CHECK(pair.completion(id).error().code == ErrorCode::buffer_limit_violation);
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

TEST_CASE("a session that has ended does not begin again in what its client sends behind the end") {
  Loopback pair;
  pair.connect();
  while (pair.service->poll_event()) {
  }
  pair.forge(*pair.client, [](Message& message) {
    message.begin_entry(EntryType::disconnect_client, {}, {}, 100);
    message.add_text("servicename", "arm");
    message.begin_entry(EntryType::connect_client, "arm", {}, 101);
    message.add_text("servicename", "arm");
  });
  pair.carry(*pair.client, *pair.service, 1u << 20);
  pair.next_service<ClientGone>();
  CHECK_FALSE(pair.service->poll_event());
}

TEST_CASE("an application may use the session, or end it, while it is asked for an object") {
  Loopback pair;
  pair.connect();
  SECTION("it sends something") {
    pair.root->while_finding = [&] { pair.service->release_path("arm.slots[1]", pair.now); };
    pair.client->find_object("arm.tools[a]", pair.now);
    pair.pump();
    CHECK(pair.next_client<PathReleased>().path == "arm.slots[1]");
    CHECK(pair.next_client<Completed>().result.value() == Value("experimental.loopback.Tool"));
  }
  SECTION("it sends something while another node's question of the same connection is answered") {
    pair.root->while_finding = [&] { pair.service->release_path("arm.slots[1]", pair.now); };
    pair.forge(*pair.client, [](Message& message) {
      message.begin_entry(EntryType::get_node_info, {}, {}, 100);
      message.begin_entry(EntryType::object_type_name, "arm.tools[a]", {}, 101);
    });
    pair.carry(*pair.client, *pair.service, 1u << 20);
    const auto sent = pair.service->poll_transmit();
    std::string bytes;
    for (const auto& part : sent) bytes.append(part.begin(), part.end());
    CHECK_THAT(bytes, Catch::Contains("experimental.loopback.Tool"));
  }
  SECTION("it ends the session") {
    pair.completion(pair.client->find_object("arm.tools[a]", pair.now)).value();
    pair.service->service()->forget_path("arm.tools[a]");
    pair.root->while_finding = [&] { pair.service->close_service(pair.now); };
    pair.client->get_property("arm.tools[a]", "name", pair.now);
    pair.pump();
    CHECK(pair.client->state() == ClientState::closed);
  }
}

TEST_CASE("few paths lead to one object, and all of them are released with it") {
  Loopback pair;
  pair.connect();
  auto& service = *pair.service->service();
  const auto find = [&](std::string_view path) { return pair.completion(pair.client->find_object(path, pair.now)); };
  REQUIRE(find("arm.tools[a%2db%2ec]"));
  REQUIRE(find("arm.tools[a%2Db%2Ec]"));
  REQUIRE(find("arm.tools[a-b%2ec]"));
  REQUIRE(find("arm.tools[%C3%A4%2e]"));  // as RobotRaconteurWeb spells it
  REQUIRE(find("arm.tools[%ffffffc3%ffffffa4]"));
  REQUIRE(find("arm.slots[-1]"));
  REQUIRE(find("arm.tool"));
  const auto asked = pair.root->asked.size();
  for (const auto* path :
       {"arm.tools[%2D%2db]", "arm.tools[%2e%2E]", "arm.tools[a-b%2dc]", "arm.tools[%61]", "arm.tools[%ffffffc3%a4]"})
    CHECK(find(path).error().code == ErrorCode::service_error);
  for (const auto* path : {"arm.slots[01]", "arm.slots[-0]", "arm.slots[1a]", "arm.slots", "arm.tool[0]"})
    CHECK(find(path).error().code == ErrorCode::invalid_argument);
  const auto longest = "arm.tools[" + std::string(max_path_size - 11, 'a') + "]";
  CHECK(find(longest));
  CHECK(find("arm.tools[a" + longest.substr(10)).error().code == ErrorCode::service_error);
  CHECK(pair.root->asked.size() == asked + 1);

  CHECK(service.forget_path("arm.tools[a%2db%2ec]") ==
        std::vector<std::string>{"arm.tools[a%2Db%2Ec]", "arm.tools[a%2db%2ec]", "arm.tools[a-b%2ec]"});
  CHECK_FALSE(service.has_object("arm.tools[a-b%2ec]"));
  CHECK(service.has_object(longest));
  CHECK(service.forget_path("arm.tools[a%2db%2ec]").empty());
}

TEST_CASE("a path is remembered while a client uses it; where there is no room, an object is refused") {
  constexpr int room = 4095;  // beside the root
  Loopback pair;
  pair.connect();
  auto& hosted = *pair.directory.find("arm");
  const auto find = [&](const std::string& path) { return pair.completion(pair.client->find_object(path, pair.now)); };
  for (int i = 0; i < room; ++i) find(slot(i)).value();
  const auto refused = find(slot(room));
  REQUIRE_FALSE(refused);
  CHECK(refused.error().code == ErrorCode::out_of_system_resource);
  CHECK_THAT(refused.error().message, Catch::Contains("'arm.slots[4095]'") && Catch::Contains("at most 4096"));
  for (const auto i : {0, 7, room - 1}) CHECK(hosted.has_object(slot(i)));

  SECTION("a path that is released makes room for one") {
    for (const auto& spelling : hosted.forget_path(slot(7))) pair.service->release_path(spelling, pair.now);
    pair.pump();
    pair.next_client<PathReleased>();
    CHECK(find(slot(room)));
    CHECK_FALSE(find(slot(room + 1)));
  }
  SECTION("the paths of a client that has left go where there is need") {
    pair.service->handle_closed({ErrorCode::connection_error, "gone"}, pair.now);
    CHECK(hosted.has_object(slot(room - 1)));
    ClientOptions options;
    options.connection.self = {client_id, "test.client"};
    options.service = "arm";
    pair.client = std::make_unique<ClientSession>(options, pair.now);
    pair.service = std::make_unique<ServiceSession>(pair.directory, ServiceSessionOptions{}, pair.now);
    pair.connect();
    CHECK(find(slot(3)));
    for (int i = room; i < 2 * room - 1; ++i) find(slot(i)).value();
    CHECK(hosted.has_object(slot(3)));
    CHECK_FALSE(hosted.has_object(slot(4)));
    CHECK_FALSE(find(slot(4)));
  }
}

TEST_CASE("an object that is asked for without a session is not remembered") {
  Loopback pair;
  pair.connect();
  pair.forge(*pair.client, [](Message& message) {
    message.begin_entry(EntryType::get_node_info, {}, {}, 100);
    message.begin_entry(EntryType::object_type_name, "arm.tools[a]", {}, 101);
  });
  pair.carry(*pair.client, *pair.service, 1u << 20);
  std::string bytes;
  for (const auto& part : pair.service->poll_transmit()) bytes.append(part.begin(), part.end());
  CHECK_THAT(bytes, Catch::Contains("experimental.loopback.Tool"));
  CHECK(pair.root->asked == std::vector<std::string>{"tools[a]"});
  CHECK_FALSE(pair.directory.find("arm")->has_object("arm.tools[a]"));
}
