// Wires between a client and a service session: the newest value, both ways, to all who have connected.
#include <catch2/catch.hpp>

#include "test/core/session/loopback.hpp"
#include "test/support/print.hpp"

using namespace rr;
using namespace rr::test;

namespace {

Value pose(double x) {
  return Structure{"experimental.loopback.Pose", {{"x", Value(x)}, {"joints", Value(std::vector<double>{1, 2, 3})}}};
}

/// Alone more than wire_high_mark.
Value large_pose(double x) {
  return Structure{"experimental.loopback.Pose", {{"x", Value(x)}, {"joints", Value(std::vector<double>(10'000))}}};
}

/// The wires `aim`, `plan` and `torque` are connected, and no events wait.
void connect_wires(Loopback& pair) {
  pair.connect();
  for (const auto* wire : {"aim", "plan", "torque"})
    pair.completion(pair.client->connect_wire("arm", wire, pair.now)).value();
  while (pair.service->poll_event()) {
  }
}

/// Of the events that wait, those that bring a number: `plan` has poses.
template <class Received, class Session>
int count_torques(Session& session) {
  int count = 0;
  while (const auto event = session.poll_event())
    if (const auto* received = std::get_if<Received>(&*event)) count += received->value.template to<double>() ? 1 : 0;
  return count;
}

}  // namespace

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

TEST_CASE("what a stream does not take of a value that was lent is kept for it, ahead of what is sent next") {
  std::vector<std::unique_ptr<Loopback>> pairs;
  for (int i = 0; i < 3; ++i) {
    auto& pair = *pairs.emplace_back(std::make_unique<Loopback>());
    pair.connect();
    pair.completion(pair.client->connect_wire("arm", "state", pair.now)).value();
    pair.next_service<WireConnected>();
  }
  const auto& state = *pairs.front()->service->service()->root_type().find_member("state");
  const auto send = [&](const Value& value, std::int64_t time, std::size_t share) {
    WirePacket packet("arm", state, value, {time, 0}, pairs.front()->now.steady);
    for (const auto& pair : pairs) {
      const bool is_queued = pair->service->queued_bytes() > 0;
      LentMessage lent;
      REQUIRE(pair->service->send_wire(packet, pair->now, &lent));
      REQUIRE((lent.message == nullptr) == is_queued);
      if (is_queued) continue;
      Bytes bytes;
      for (const auto slice : lent.slices) bytes.insert(bytes.end(), slice.begin(), slice.end());
      CHECK(bytes.size() == lent.size);
      const auto written = ByteSpan(bytes).first(lent.size * share / 4);
      CHECK(pair->client->handle_bytes(written, pair->now) == written.size());
      CHECK(pair->service->handle_lent(lent, written.size(), pair->now) == (share == 4));
      CHECK((pair->service->queued_bytes() == 0) == (share == 4));
    }
  };
  const auto share = GENERATE(std::size_t{0}, std::size_t{1}, std::size_t{3}, std::size_t{4});
  const auto sent_before = pairs.front()->service->connection().stats().bytes_sent;
  send(pose(1), 50, share);
  send(pose(2), 51, 4);
  for (const auto& pair : pairs) pair->pump();
  for (const auto& pair : pairs) {
    for (std::int32_t i = 1; i <= 2; ++i) CHECK(pair->next_client<WireValueReceived>().value == pose(i));
    CHECK_FALSE(pair->client->poll_event());
    CHECK(pair->service->total_ledgers().wires.delivered == 2);
    CHECK(pair->service->connection().stats().bytes_sent > sent_before);
    CHECK(pair->service->connection().stats().bytes_sent == pair->client->connection().stats().bytes_received);
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

TEST_CASE("a value that does not fit holds up no other wire while the stream is slow") {
  Loopback pair;
  pair.connect();
  for (const auto* wire : {"aim", "torque"}) pair.completion(pair.client->connect_wire("arm", wire, pair.now)).value();
  while (pair.service->poll_event()) {
  }
  const Value large(
      Structure{"experimental.loopback.Pose", {{"x", Value(1.0)}, {"joints", Value(std::vector<double>(50'000))}}});
  pair.client->set_property("arm", "pose", large, pair.now);
  REQUIRE(pair.client->send_wire("arm", "aim", Value("text"), pair.now));  // waits, and does not fit
  REQUIRE(pair.client->send_wire("arm", "torque", Value(2.0), pair.now));
  pair.pump();
  double last = 0;
  while (const auto event = pair.service->poll_event())
    if (const auto* received = std::get_if<WireReceived>(&*event)) last = received->value.to<double>().value();
  CHECK(last == 2.0);
}

TEST_CASE("a wire whose object is replaced while it is being connected fails, and is left") {
  Loopback pair;
  pair.connect();
  pair.completion(pair.client->find_object("arm.tool", pair.now)).value();
  const auto connecting = pair.client->connect_wire("arm.tool", "force", pair.now);
  pair.service->release_path("arm.tool", pair.now);
  pair.carry(*pair.service, *pair.client, 1u << 20);
  const auto failed = pair.next_client<Completed>();
  CHECK(failed.id == connecting);
  REQUIRE_FALSE(failed.result);
  CHECK(failed.result.error().code == ErrorCode::object_not_found);
  CHECK_THAT(failed.result.error().message, Catch::Contains("was replaced"));
  CHECK(pair.next_client<PathReleased>().path == "arm.tool");
  pair.pump();  // the service connects it, as it was asked to
  pair.next_service<WireConnected>();
  CHECK(pair.next_service<WireDisconnected>().path == "arm.tool");
  CHECK_FALSE(pair.service->has_wire("arm.tool", "force"));
  CHECK_FALSE(pair.client->poll_event());
}

TEST_CASE("a wire of large values does not hold up those that sort behind it") {
  Loopback pair;
  connect_wires(pair);
  const auto* type = pair.client->object_type("arm");
  const auto& plan = *type->find_member("plan");
  SECTION("to the client") {
    REQUIRE(pair.service->send_wire("arm", plan, large_pose(0), pair.now));
    REQUIRE(pair.service->send_wire("arm", *type->find_member("torque"), Value(2.0), pair.now));
    for (int i = 1; i < 5; ++i) {
      REQUIRE(pair.service->send_wire("arm", plan, large_pose(i), pair.now));
      pair.carry(*pair.service, *pair.client, 1u << 20);
    }
    CHECK(count_torques<WireValueReceived>(*pair.client) == 1);
  }
  SECTION("to the service") {
    REQUIRE(pair.client->send_wire("arm", "plan", large_pose(0), pair.now));
    REQUIRE(pair.client->send_wire("arm", "torque", Value(2.0), pair.now));
    for (int i = 1; i < 5; ++i) {
      REQUIRE(pair.client->send_wire("arm", "plan", large_pose(i), pair.now));
      pair.carry(*pair.client, *pair.service, 1u << 20);
    }
    CHECK(count_torques<WireReceived>(*pair.service) == 1);
  }
}

TEST_CASE("a service's value that does not fit holds up no other wire while the stream is slow") {
  Loopback pair;
  connect_wires(pair);
  const auto* type = pair.client->object_type("arm");
  REQUIRE(pair.service->send_wire("arm", *type->find_member("plan"), large_pose(0), pair.now));
  REQUIRE(pair.service->send_wire("arm", *type->find_member("aim"), Value("text"), pair.now));
  REQUIRE(pair.service->send_wire("arm", *type->find_member("torque"), Value(2.0), pair.now));
  pair.pump();
  CHECK(count_torques<WireValueReceived>(*pair.client) == 1);
}

TEST_CASE("the last value of a wire is sent before what ends the wire") {
  Loopback pair;
  connect_wires(pair);
  pair.client->set_property("arm", "pose", large_pose(0), pair.now);
  REQUIRE(pair.client->send_wire("arm", "torque", Value(2.0), pair.now));  // waits
  SECTION("which is its disconnect") {
    pair.client->disconnect_wire("arm", "torque", pair.now);
    pair.pump();
    pair.next_service<Called>();
    CHECK(pair.next_service<WireReceived>().value == Value(2.0));
    pair.next_service<WireDisconnected>();
  }
  SECTION("which is the end of the session") {
    pair.client->disconnect(pair.now);
    pair.pump();
    pair.next_service<Called>();
    CHECK(pair.next_service<WireReceived>().value == Value(2.0));
    pair.next_service<ClientGone>();
  }
}

TEST_CASE("a value that waits for the stream is not sent behind a newer one that is poked") {
  Loopback pair;
  connect_wires(pair);
  pair.client->set_property("arm", "pose", large_pose(0), pair.now);
  REQUIRE(pair.client->send_wire("arm", "torque", Value(1.0), pair.now));  // waits
  SECTION("but replaced by it") {
    pair.client->poke_out_value("arm", "torque", Value(2.0), pair.now);
    pair.pump();
    pair.next_service<Called>();
    CHECK(pair.next_service<Called>().arguments == std::vector<Value>{Value(2.0)});
  }
  SECTION("one that does not fit replaces nothing") {
    pair.client->poke_out_value("arm", "torque", Value("text"), pair.now);
    pair.pump();
    pair.next_service<Called>();
    CHECK(pair.next_service<WireReceived>().value == Value(1.0));
  }
  CHECK_FALSE(pair.service->poll_event());
}
