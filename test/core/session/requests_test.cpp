// Requests, events and objects between a client and a service session: what each becomes on the other side, and its
// answer back.
#include <catch2/catch.hpp>

#include "test/core/session/loopback.hpp"
#include "test/support/print.hpp"

using namespace rr;
using namespace rr::test;

namespace {

Value pose(double x) {
  return Structure{"experimental.loopback.Pose", {{"x", Value(x)}, {"joints", Value(std::vector<double>{1, 2, 3})}}};
}

}  // namespace

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

  SECTION("what an error tells may be of the service's types") {
    id = pair.client->call_function("arm", "jam", {}, pair.now);
    pair.pump();
    const Structure pose{"experimental.loopback.Pose",
                         {{"x", Value(1.0)}, {"joints", Value(Array::take(std::vector<double>{2.0}))}}};
    jammed.param = std::make_shared<const Value>(pose);
    pair.service->reply(pair.next_service<Called>().id, jammed, pair.now);
    const auto told = pair.completion(id).error().param;
    REQUIRE(told);
    CHECK(*told == Value(pose));
  }
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

TEST_CASE("a definition that waits to be sent outlives its service") {
  Loopback pair;
  const auto text =
      "service experimental.large\n# " + std::string(2 * EncodedMessage::gather_threshold, 'x') + "\nobject Arm\nend\n";
  auto types = std::make_shared<TypeRegistry>();
  types->add({text}, RobdefMode::strict).value();
  const std::weak_ptr<const TypeRegistry> kept = types;
  const auto root = std::make_shared<PlainObject>("experimental.large.Arm");
  pair.directory.add(HostedService::make("large", root, std::move(types)).value()).value();
  const auto ask = [&](bool by_type) {
    pair.forge(*pair.client, [by_type](Message& message) {
      message.begin_entry(EntryType::get_service_desc, "large", "", 7);
      message.add_text("clientversion", "0.9.4");
      if (by_type) message.add_text("ServiceType", "experimental.large");
    });
  };
  SECTION("of the root") {
    pair.lose_requests();
    ask(false);
  }
  SECTION("by name") {
    pair.lose_requests();
    ask(true);
  }
  SECTION("with the login") {
    ClientOptions options;
    options.connection.self = {client_id, "test.client"};
    options.service = "large";
    pair.client = std::make_unique<ClientSession>(options, pair.now);
    pair.carry(*pair.client, *pair.service, 1u << 20);  // the stream is agreed on first
    pair.carry(*pair.service, *pair.client, 1u << 20);
  }
  pair.carry(*pair.client, *pair.service, 1u << 20);
  pair.directory.remove("large");
  pair.service->close_service(pair.now);

  CHECK_FALSE(kept.expired());
  Bytes bytes;
  for (const auto slice : pair.service->poll_transmit()) bytes.insert(bytes.end(), slice.begin(), slice.end());
  CHECK(as_text(bytes).find(text) != std::string_view::npos);
  pair.service->handle_transmitted(bytes.size(), pair.now);
  CHECK(kept.expired());
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
  CHECK(service.forget_path("arm.tool").size() == 1);
  CHECK(service.forget_path("arm.tool").empty());
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
