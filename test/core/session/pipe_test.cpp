// Pipes between client and service sessions.
#include <catch2/catch.hpp>

#include "test/core/session/pipe_messages.hpp"
#include "test/support/print.hpp"

using namespace rr;
using namespace rr::test;

namespace {

/// An endpoint of `samples` between both sessions.
struct Pipe : Loopback {
  explicit Pipe(std::string name = "samples", Features client_features = {}) : Loopback(client_features) {
    member = std::move(name);
    connect();
    const auto request = client->connect_pipe("arm", member, any_pipe_index, now);
    pump();
    const auto wanted = next_service<PipeConnected>();
    CHECK(wanted.object == root);
    CHECK(wanted.member->name == member);
    id = wanted.id;
    service->accept_pipe(id, now);
    index = completion(request).value().to<std::int32_t>().value();
    CHECK(index == wanted.index);
  }
  Result<std::uint32_t> send(double value, bool wants_ack = false) {
    return client->send_pipe_packet("arm", member, index, Value(value), now, wants_ack);
  }

  std::string member;
  PipeId id = 0;
  std::int32_t index = 0;
};

Features only_version_2() {
  Features features;
  features.v4 = false;
  return features;
}

/// The same two with other bounds.
void start_again(Loopback& pair, ClientOptions options, ServiceSessionOptions service_options = {}) {
  options.connection.self = {client_id, ""};
  options.service = "arm";
  pair.client = std::make_unique<ClientSession>(std::move(options), pair.now);
  pair.service = std::make_unique<ServiceSession>(pair.directory, std::move(service_options), pair.now);
  pair.connect();
}

}  // namespace

TEST_CASE("a packet for many endpoints is to each the one that it would get alone") {
  const MemberDefinition member{MemberKind::pipe, "samples", TypeDefinition{.type = DataType::double_t}};
  const Value value(2.5);
  const bool wants_ack = GENERATE(false, true);
  SharedPipePacket packet(value, wants_ack);
  struct {
    std::string path;
    bool is_unreliable;
    std::int32_t index;
    std::uint32_t number;
  } const endpoints[] = {{"arm", false, 1, 7},   {"arm", false, 1, 8},  {"arm", false, 1, 4'000'000'000},
                         {"arm", false, 21, 21}, {"arm", true, 21, 22}, {"leg", true, 21, 23},
                         {"arm", false, 1, 9}};
  std::uint16_t message_id = 0;
  for (const auto& [path, is_unreliable, index, number] : endpoints) {
    INFO(path << " " << is_unreliable << " " << index << " " << number);
    const auto bytes_of = [&](auto& message, auto&& encode_it) {
      message.header.message_id = ++message_id;
      message.header.has_routing = message.header.has_endpoints = false;
      EncodedMessage encoded;
      REQUIRE(encode_it(encoded));
      --message_id;
      return encoded.to_bytes();
    };
    Message alone;
    begin_pipe_packets(alone, path, "samples", is_unreliable);
    REQUIRE(write_pipe_packet(alone, index, number, value, wants_ack, member, {}));
    auto& shared = *packet.message(path, member, is_unreliable, index, number, {}).value();
    CHECK(bytes_of(shared.message, [&](EncodedMessage& out) { return shared.encode({}, out); }) ==
          bytes_of(alone, [&](EncodedMessage& out) { return encode(alone, {}, out); }));
    ++message_id;
  }
}

TEST_CASE("packets go both ways, with numbers and acknowledgements, in both versions") {
  for (const auto& features : {Features{}, only_version_2()}) {
    Pipe pair("samples", features);
    CHECK(pair.send(1.5).value() == 1);
    CHECK(pair.send(2.5, true).value() == 2);
    pair.pump();
    auto received = pair.next_service<PipeReceived>();
    CHECK(received.id == pair.id);
    CHECK(received.value == Value(1.5));
    CHECK(pair.next_service<PipeReceived>().value == Value(2.5));
    const auto arrived = pair.next_client<PipePacketsAcknowledged>();
    CHECK(arrived.index == pair.index);
    CHECK(arrived.numbers == std::vector<std::uint32_t>{2});

    CHECK(pair.service->send_pipe_packet(pair.id, Value(7.0), pair.now, true).value() == 1);
    pair.pump();
    const auto packet = pair.next_client<PipePacketReceived>();
    CHECK(packet.member == "samples");
    CHECK(packet.index == pair.index);
    CHECK(packet.value == Value(7.0));
    const auto acknowledged = pair.next_service<PipeAcknowledged>();
    CHECK(acknowledged.id == pair.id);
    CHECK(acknowledged.numbers == std::vector<std::uint32_t>{1});
  }
}

TEST_CASE("indices are assigned as the reference assigns them") {
  Loopback pair;
  pair.connect();
  const auto index_for = [&](std::int32_t asked) {
    const auto request = pair.client->connect_pipe("arm", "samples", asked, pair.now);
    pair.pump();
    pair.service->accept_pipe(pair.next_service<PipeConnected>().id, pair.now);
    return pair.completion(request).value().to<std::int32_t>().value();
  };
  CHECK(index_for(-1) == 1);
  CHECK(index_for(1) == 2);
  CHECK(index_for(10) == 10);
  CHECK(index_for(3) == 11);
  CHECK(index_for(-1) == 12);
  CHECK(index_for(INT32_MAX) == INT32_MAX);
  const auto request = pair.client->connect_pipe("arm", "samples", -1, pair.now);
  CHECK(pair.completion(request).error().code == ErrorCode::out_of_range);
}

TEST_CASE("the application may refuse an endpoint; its first packet lets the client in") {
  Loopback pair;
  pair.connect();
  auto request = pair.client->connect_pipe("arm", "samples", any_pipe_index, pair.now);
  pair.pump();
  auto id = pair.next_service<PipeConnected>().id;
  pair.service->refuse_pipe(id, {ErrorCode::operation_failed, "not today"}, pair.now);
  pair.service->accept_pipe(id, pair.now);  // too late
  CHECK(pair.completion(request).error().message == "not today");
  CHECK_FALSE(pair.service->send_pipe_packet(id, Value(1.0), pair.now));

  request = pair.client->connect_pipe("arm", "samples", any_pipe_index, pair.now);
  pair.pump();
  id = pair.next_service<PipeConnected>().id;
  REQUIRE(pair.service->send_pipe_packet(id, Value(1.0), pair.now));
  pair.service->refuse_pipe(id, {ErrorCode::operation_failed, "too late"}, pair.now);
  CHECK(pair.completion(request).value() == Value(1));
  CHECK(pair.next_client<PipePacketReceived>().value == Value(1.0));
}

TEST_CASE("the client closes an endpoint: both sides forget it") {
  Pipe pair;
  const auto request = pair.client->disconnect_pipe("arm", "samples", pair.index, pair.now);
  CHECK(pair.send(1.0).error().code == ErrorCode::invalid_operation);
  REQUIRE(pair.service->send_pipe_packet(pair.id, Value(1.0), pair.now));  // crosses the request
  pair.pump();
  CHECK(pair.next_service<PipeClosed>().id == pair.id);
  CHECK(pair.completion(request).value().is_null());
  CHECK_FALSE(pair.client->poll_event());
  CHECK(pair.service->send_pipe_packet(pair.id, Value(1.0), pair.now).error().code == ErrorCode::invalid_operation);
  CHECK(pair.completion(pair.client->disconnect_pipe("arm", "samples", pair.index, pair.now)).value().is_null());
  CHECK(pair.client->pending_requests() == 0);
}

TEST_CASE("an endpoint is closed also where the answer has the type of the request, as RobotRaconteurWeb answers") {
  Pipe pair;
  const auto request = pair.client->disconnect_pipe("arm", "samples", pair.index, pair.now);
  pair.lose_requests();
  pair.forge(*pair.service,
             [&](Message& message) { message.begin_entry(EntryType::pipe_disconnect_req, "arm", "samples", request); });
  CHECK(pair.completion(request).value().is_null());
  CHECK(pair.client->pending_requests() == 0);
}

TEST_CASE("the service closes an endpoint: the client is told, and its own close is good as well") {
  Pipe pair;
  SECTION("alone") {
    pair.service->close_pipe(pair.id, pair.now);
    pair.pump();
    const auto closed = pair.next_client<PipeClosedByService>();
    CHECK(closed.member == "samples");
    CHECK(closed.index == pair.index);
  }
  SECTION("while the client's request is on its way") {
    const auto request = pair.client->disconnect_pipe("arm", "samples", pair.index, pair.now);
    pair.service->close_pipe(pair.id, pair.now);
    CHECK(pair.completion(request).value().is_null());
  }
  CHECK(pair.send(1.0).error().code == ErrorCode::invalid_operation);
  CHECK_FALSE(pair.client->poll_event());
  CHECK_FALSE(pair.service->poll_event());
}

TEST_CASE("packets of an endpoint that was given up before it was connected reach no other") {
  Loopback pair;
  pair.connect();
  const auto connect = [&] { return pair.client->connect_pipe("arm", "samples", any_pipe_index, pair.now); };
  pair.client->cancel(connect());
  pair.carry(*pair.client, *pair.service, 1u << 20);
  const auto given_up = pair.next_service<PipeConnected>().id;
  pair.service->accept_pipe(given_up, pair.now);
  pair.carry(*pair.service, *pair.client, 1u << 20);  // which asks for its end
  const auto request = connect();
  REQUIRE(pair.service->send_pipe_packet(given_up, Value(1.0), pair.now));
  pair.carry(*pair.service, *pair.client, 1u << 20);
  pair.carry(*pair.client, *pair.service, 1u << 20);
  CHECK(pair.next_service<PipeClosed>().id == given_up);
  const auto id = pair.next_service<PipeConnected>().id;
  REQUIRE(pair.service->send_pipe_packet(id, Value(2.0), pair.now));
  CHECK(pair.completion(request).value() == Value(2));
  CHECK(pair.next_client<PipePacketReceived>().value == Value(2.0));
  CHECK_FALSE(pair.client->poll_event());
}

TEST_CASE("a client that closes an endpoint gets the next one by another index, unless it names the same") {
  Loopback pair;
  pair.connect();
  const auto index_for = [&](std::int32_t asked) {
    const auto request = pair.client->connect_pipe("arm", "samples", asked, pair.now);
    pair.pump();
    pair.service->accept_pipe(pair.next_service<PipeConnected>().id, pair.now);
    return pair.completion(request).value().to<std::int32_t>().value();
  };
  const auto close = [&](std::int32_t index) {
    const auto request = pair.client->disconnect_pipe("arm", "samples", index, pair.now);
    CHECK(pair.completion(request).value().is_null());
    pair.next_service<PipeClosed>();
  };
  CHECK(index_for(any_pipe_index) == 1);
  close(1);
  CHECK(index_for(any_pipe_index) == 2);
  close(2);
  CHECK(index_for(2) == 2);
  close(2);
  CHECK(index_for(1) == 1);
}

TEST_CASE("a connect that was given up is undone also where it is answered after its time") {
  Loopback pair;
  pair.connect();
  pair.client->cancel(pair.client->connect_pipe("arm", "samples", any_pipe_index, pair.now));
  pair.pump();
  const auto id = pair.next_service<PipeConnected>().id;
  pair.advance(std::chrono::seconds(20));
  pair.client->handle_timeout(pair.now);
  pair.service->accept_pipe(id, pair.now);
  pair.pump();
  CHECK(pair.next_service<PipeClosed>().id == id);
  CHECK_FALSE(pair.client->poll_event());
}

TEST_CASE("acknowledgements that are held back come in their order when they are let go") {
  Pipe pair;
  const auto send = [&](double value) {
    REQUIRE(pair.service->send_pipe_packet(pair.id, Value(value), pair.now, true));
    pair.pump();
    CHECK(pair.next_client<PipePacketReceived>().value == Value(value));
  };
  const auto hold = [&](bool is_held) {
    pair.client->hold_pipe_acks("arm", "samples", pair.index, is_held, pair.now);
    pair.pump();
  };
  const auto expect_acknowledged = [&](std::uint32_t number) {
    CHECK(pair.next_service<PipeAcknowledged>().numbers == std::vector<std::uint32_t>{number});
  };
  send(1.0);
  expect_acknowledged(1);
  hold(true);
  hold(true);
  for (const double value : {2.0, 3.0, 4.0}) send(value);
  CHECK_FALSE(pair.service->poll_event());

  SECTION("let go") {
    hold(false);
    for (const std::uint32_t number : {2u, 3u, 4u}) expect_acknowledged(number);
    send(5.0);
    expect_acknowledged(5);
    hold(false);
  }
  SECTION("another endpoint goes on meanwhile") {
    const auto request = pair.client->connect_pipe("arm", "samples", any_pipe_index, pair.now);
    pair.pump();
    const auto other = pair.next_service<PipeConnected>().id;
    pair.service->accept_pipe(other, pair.now);
    REQUIRE(pair.completion(request));
    REQUIRE(pair.service->send_pipe_packet(other, Value(9.0), pair.now, true));
    pair.pump();
    CHECK(pair.next_client<PipePacketReceived>().value == Value(9.0));
    const auto acknowledged = pair.next_service<PipeAcknowledged>();
    CHECK(acknowledged.id == other);
    CHECK(acknowledged.numbers == std::vector<std::uint32_t>{1});
  }
  SECTION("they end with the endpoint, and the next one of its index holds nothing") {
    const auto closed = pair.client->disconnect_pipe("arm", "samples", pair.index, pair.now);
    REQUIRE(pair.completion(closed));
    CHECK(pair.next_service<PipeClosed>().id == pair.id);
    hold(false);
    const auto request = pair.client->connect_pipe("arm", "samples", pair.index, pair.now);
    pair.pump();
    pair.id = pair.next_service<PipeConnected>().id;
    pair.service->accept_pipe(pair.id, pair.now);
    REQUIRE(pair.completion(request).value() == Value(pair.index));
    send(1.0);
    expect_acknowledged(1);
  }
  SECTION("they end with the session") {
    pair.client->handle_closed(make_error(ErrorCode::connection_error, "gone"), pair.now);
    pair.client->hold_pipe_acks("arm", "samples", pair.index, false, pair.now);
    CHECK(pair.client->poll_transmit().empty());
  }
  CHECK_FALSE(pair.service->poll_event());
}

TEST_CASE("a service that does not mind credit is held back no packet more than there is room for") {
  Loopback pair;
  pair.connect();
  ClientOptions options;
  options.max_held_acks = 3;
  start_again(pair, options);
  const auto request = pair.client->connect_pipe("arm", "samples", any_pipe_index, pair.now);
  pair.pump();
  const auto id = pair.next_service<PipeConnected>().id;
  pair.service->accept_pipe(id, pair.now);
  const auto index = pair.completion(request).value().to<std::int32_t>().value();
  pair.client->hold_pipe_acks("arm", "samples", index, true, pair.now);
  for (std::uint32_t number = 1; number <= 10; ++number)
    REQUIRE(pair.service->send_pipe_packet(id, Value(1.0 * number), pair.now, true));
  pair.pump();
  for (std::uint32_t number = 1; number <= 7; ++number)
    CHECK(pair.next_service<PipeAcknowledged>().numbers == std::vector<std::uint32_t>{number});
  CHECK_FALSE(pair.service->poll_event());
  pair.client->hold_pipe_acks("arm", "samples", index, false, pair.now);
  pair.pump();
  for (std::uint32_t number = 8; number <= 10; ++number)
    CHECK(pair.next_service<PipeAcknowledged>().numbers == std::vector<std::uint32_t>{number});
}

TEST_CASE("packets for a remote service are acknowledged when they have arrived there") {
  Pipe pair;
  pair.directory.find("arm")->set_remote();
  REQUIRE(pair.send(1.0, true));
  REQUIRE(pair.send(2.0));
  REQUIRE(pair.send(3.0, true));
  pair.pump();
  CHECK(pair.next_service<PipeReceived>().wants_ack == 1u);
  CHECK_FALSE(pair.next_service<PipeReceived>().wants_ack);
  CHECK(pair.next_service<PipeReceived>().wants_ack == 3u);
  CHECK_FALSE(pair.client->poll_event());
  const std::vector<std::uint32_t> arrived{1, 3};
  pair.service->acknowledge_pipe(pair.id, arrived, pair.now);
  pair.service->acknowledge_pipe(pair.id + 1, arrived, pair.now);
  pair.pump();
  for (const auto number : arrived)
    CHECK(pair.next_client<PipePacketsAcknowledged>().numbers == std::vector<std::uint32_t>{number});
  CHECK_FALSE(pair.client->poll_event());
}

TEST_CASE("directions: nobody sends against them, and what comes against them is acknowledged and dropped") {
  Pipe poses("poses");
  CHECK(poses.send(1.0).error().code == ErrorCode::read_only_member);
  Pipe orders("orders");
  CHECK(orders.service->send_pipe_packet(orders.id, Value(1.0), orders.now).error().code ==
        ErrorCode::write_only_member);
  const auto packet = [](std::string_view pipe, std::int32_t index) {
    return [pipe, index](Message& message) {
      message.begin_entry(EntryType::pipe_packet, "arm", pipe);
      add_packet(message, index, 1, 1.0, true);
    };
  };
  orders.client->handle_bytes(encode_from(orders.client->connection(), packet("orders", orders.index)), orders.now);
  orders.pump();
  CHECK_FALSE(orders.client->poll_event());
  CHECK(orders.next_service<PipeAcknowledged>().numbers == std::vector<std::uint32_t>{1});
  poses.service->handle_bytes(encode_from(poses.service->connection(), packet("poses", poses.index)), poses.now);
  poses.pump();
  CHECK_FALSE(poses.service->poll_event());
  CHECK(poses.next_client<PipePacketsAcknowledged>().numbers == std::vector<std::uint32_t>{1});
}

TEST_CASE("an unreliable pipe is agreed on where the definition says so") {
  Pipe pair("quick");
  const auto packet = [&](std::uint32_t number, double value) {
    pair.service->handle_bytes(encode_from(pair.service->connection(),
                                           [&](Message& message) {
                                             message.begin_entry(EntryType::pipe_packet, "arm", "quick");
                                             add_packet(message, pair.index, number, value);
                                           }),
                               pair.now);
  };
  packet(3, 3.0);
  packet(2, 2.0);
  CHECK(pair.next_service<PipeReceived>().value == Value(3.0));
  CHECK(pair.next_service<PipeReceived>().value == Value(2.0));
}

TEST_CASE("a client's packet that can never be made up for closes its endpoint, too") {
  Pipe pair;
  pair.service->handle_bytes(encode_from(pair.service->connection(),
                                         [&](Message& message) {
                                           message.begin_entry(EntryType::pipe_packet, "arm", "samples");
                                           add_packet(message, pair.index, 5000, 1.0);
                                         }),
                             pair.now);
  CHECK(pair.next_service<PipeClosed>().id == pair.id);
  pair.pump();
  CHECK(pair.next_client<PipeClosedByService>().index == pair.index);
}

TEST_CASE("a stalled stream is the sender's error, and nothing is lost") {
  Loopback pair;
  pair.connect();
  ClientOptions options;
  options.max_pipe_queued_bytes = 1000;
  ServiceSessionOptions service_options;
  service_options.max_pipe_queued_bytes = 1000;
  start_again(pair, options, service_options);
  const auto request = pair.client->connect_pipe("arm", "samples", any_pipe_index, pair.now);
  pair.pump();
  const auto id = pair.next_service<PipeConnected>().id;
  pair.service->accept_pipe(id, pair.now);
  REQUIRE(pair.completion(request));

  std::uint32_t sent = 0;
  Result<std::uint32_t> last = sent;
  while ((last = pair.client->send_pipe_packet("arm", "samples", 1, Value(1.0 * sent), pair.now))) ++sent;
  CHECK(last.error().code == ErrorCode::out_of_system_resource);
  CHECK(pair.client->queued_bytes() >= 1000);
  pair.pump();
  CHECK(pair.client->queued_bytes() == 0);
  REQUIRE(pair.client->send_pipe_packet("arm", "samples", 1, Value(1.0 * sent), pair.now).value() == sent + 1);
  pair.pump();
  for (std::uint32_t number = 0; number <= sent; ++number)
    CHECK(pair.next_service<PipeReceived>().value == Value(1.0 * number));

  sent = 0;
  while ((last = pair.service->send_pipe_packet(id, Value(1.0 * sent), pair.now))) ++sent;
  CHECK(last.error().code == ErrorCode::out_of_system_resource);
  pair.pump();
  REQUIRE(pair.service->send_pipe_packet(id, Value(1.0 * sent), pair.now));
  pair.pump();
  for (std::uint32_t number = 0; number <= sent; ++number)
    CHECK(pair.next_client<PipePacketReceived>().value == Value(1.0 * number));
}

TEST_CASE("a client has no more endpoints than it may") {
  Loopback pair;
  ServiceSessionOptions options;
  options.max_pipe_endpoints = 2;
  pair.service = std::make_unique<ServiceSession>(pair.directory, options, pair.now);
  pair.connect();
  std::vector<RequestId> requests;
  for (int i = 0; i < 3; ++i) requests.push_back(pair.client->connect_pipe("arm", "samples", -1, pair.now));
  CHECK(pair.completion(requests[2]).error().code == ErrorCode::out_of_system_resource);
}

TEST_CASE("a value that does not fit is refused where it is sent, and takes no number") {
  Pipe pair;
  CHECK(pair.client->send_pipe_packet("arm", "samples", pair.index, Value("text"), pair.now).error().message ==
        "pipe 'samples': pack 'packet': found string, expected double");
  CHECK(pair.send(1.0).value() == 1);
  CHECK(pair.service->send_pipe_packet(pair.id, Value("text"), pair.now).error().code == ErrorCode::data_type_mismatch);
  CHECK(pair.service->send_pipe_packet(pair.id, Value(1.0), pair.now).value() == 1);
}

TEST_CASE("a path that is released takes its endpoints along") {
  Pipe pair;
  pair.service->release_path("arm", pair.now);
  CHECK(pair.next_service<PipeClosed>().id == pair.id);
}
