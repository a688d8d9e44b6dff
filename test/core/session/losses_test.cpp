// What a service tells a client of the client's own subscriptions, within their session.
#include <catch2/catch.hpp>
#include <cmath>

#include "core/session/service/subscription_losses.hpp"
#include "test/core/session/loopback.hpp"
#include "test/support/print.hpp"

using namespace rr;
using namespace rr::test;

namespace {

struct Subscriber : Loopback {
  Subscriber() { connect(); }
  const MemberDefinition& member(std::string_view name) { return *service->service()->root_type().find_member(name); }
  void connect_wire(std::string_view name) {
    completion(client->connect_wire("arm", name, now)).value();
    next_service<WireConnected>();
  }
  Value attributes() { return completion(client->get_attributes(now)).value(); }
  std::optional<SubscriptionLosses> losses(std::string_view name, std::optional<std::int32_t> index = {}) {
    return read_losses(attributes(), "arm", name, index);
  }
};

}  // namespace

TEST_CASE("a client hears what became of the values of its wire") {
  Subscriber pair;
  pair.connect_wire("torque");
  CHECK(pair.losses("torque")->delivered == 0);
  CHECK_FALSE(pair.losses("state"));
  // What fills the stream: while it waits, newer values replace older ones.
  const std::vector<Value> event{Value(1), Value(std::string(100'000, 'x'))};
  REQUIRE(pair.service->send_event("arm", pair.member("bumped"), event, pair.now));
  for (int i = 0; i < 100; ++i)
    REQUIRE(pair.service->send_wire("arm", pair.member("torque"), Value(1.0 * i), pair.now));
  pair.advance(std::chrono::milliseconds(250));
  pair.pump();
  pair.next_client<EventReceived>();
  CHECK(pair.next_client<WireValueReceived>().value == Value(99.0));
  const auto losses = pair.losses("torque");
  REQUIRE(losses);
  CHECK(losses->delivered == 1);
  CHECK(losses->conflated == 99);
  CHECK(losses->dropped == 0);
  CHECK(losses->age_p50.count() >= 0.25);
  CHECK(losses->age_p99.count() <= 0.6);  // steps of two

  SECTION("as long as it has it") {
    pair.completion(pair.client->disconnect_wire("arm", "torque", pair.now)).value();
    CHECK_FALSE(pair.losses("torque"));
  }
}

TEST_CASE("each endpoint of a pipe has an account of its own") {
  Subscriber pair;
  for (const std::int32_t index : {3, 5}) {
    const auto id = pair.client->connect_pipe("arm", "samples", index, pair.now);
    pair.pump();
    const auto pipe = pair.next_service<PipeConnected>();
    pair.service->accept_pipe(pipe.id, pair.now);
    CHECK(pair.completion(id).value() == Value(index));
    for (std::int32_t i = 0; i < index; ++i) pair.service->send_pipe_packet(pipe.id, Value(1.0), pair.now).value();
    pair.pump();
    while (pair.client->poll_event()) {
    }
  }
  CHECK(pair.losses("samples", 3)->delivered == 3);
  CHECK(pair.losses("samples", 5)->delivered == 5);
  CHECK_FALSE(pair.losses("samples", 4));
  CHECK_FALSE(pair.losses("samples"));
}

TEST_CASE("attributes are those of the service, and nobody else's subscriptions are among them") {
  Subscriber pair;
  const auto plain = pair.attributes();
  CHECK(plain.get_if<MapString>()->items.size() == 1);
  CHECK(plain.get_if<MapString>()->find("location")->to_text().value() == "bench");
  pair.connect_wire("torque");
  const auto own = pair.attributes();
  CHECK(own.get_if<MapString>()->find("location")->to_text().value() == "bench");
  CHECK(own.get_if<MapString>()->find(losses_attribute) != nullptr);
  CHECK(own.get_if<MapString>()->find(left_out_attribute) == nullptr);

  const auto first_client = std::move(pair.client);
  const auto first_service = std::move(pair.service);
  ClientOptions options;
  options.connection.self = {NodeId{{7}}, "other.client"};
  options.service = "arm";
  pair.client = std::make_unique<ClientSession>(options, pair.now);
  pair.service = std::make_unique<ServiceSession>(pair.directory, ServiceSessionOptions{}, pair.now);
  pair.connect();
  CHECK(pair.attributes() == plain);
}

TEST_CASE("how many subscriptions are told is bounded, and how many are missing is said") {
  Subscriber pair;
  for (std::size_t i = 0; i < max_told_subscriptions + 6; ++i)
    pair.client->connect_pipe("arm", "samples", static_cast<std::int32_t>(i), pair.now);
  pair.pump();
  const auto attributes = pair.attributes();
  const auto* map = attributes.get_if<MapString>();
  CHECK(map->find(losses_attribute)->get_if<MapString>()->items.size() == max_told_subscriptions);
  CHECK(map->find(left_out_attribute)->to<std::int32_t>().value() == 6);

  SECTION("and so is what one message can ask for") {
    pair.forge(*pair.client, [](Message& message) {
      for (std::uint32_t i = 0; i < 100; ++i)
        message.begin_entry(EntryType::get_service_attributes, "arm", {}, 900 + i);
    });
    pair.carry(*pair.client, *pair.service, 1u << 20);
    Bytes bytes;
    for (const auto slice : pair.service->poll_transmit()) bytes.insert(bytes.end(), slice.begin(), slice.end());
    CHECK(bytes.size() < 200'000);
    Message answer;
    decode(bytes, {.string_table = {true, true}}, answer).value();
    REQUIRE(answer.entries.size() == 100);
    const auto told = unpack_varvalue(answer, *answer.elements_of(answer.entries.front()).find("return"), {}).value();
    CHECK(told.get_if<MapString>()->find(losses_attribute) != nullptr);
    const auto plain = unpack_varvalue(answer, *answer.elements_of(answer.entries.back()).find("return"), {}).value();
    CHECK(plain.get_if<MapString>()->items.size() == 1);
  }
}

TEST_CASE("a client that has to log in first is told the attributes, and no more") {
  Subscriber pair;
  pair.connect_wire("torque");
  SecurityPolicy policy;
  policy.require_valid_user = true;
  pair.directory.find("arm")->set_policy(policy);
  CHECK(pair.attributes().get_if<MapString>()->items.size() == 1);
}

TEST_CASE("a service that keeps no account, or says what is none") {
  const auto read = [](const Value& subscriptions) {
    MapString attributes;
    attributes.items.emplace_back(std::string(losses_attribute), subscriptions);
    return read_losses(Value(std::move(attributes)), "arm", "torque");
  };
  CHECK_FALSE(read_losses(Value(MapString{}), "arm", "torque"));
  CHECK_FALSE(read_losses(Value{}, "arm", "torque"));
  CHECK_FALSE(read(Value("much")));
  CHECK_FALSE(read(Value(MapString{})));
  const auto with = [&read](const Value& numbers) {
    MapString subscriptions;
    subscriptions.items.emplace_back("arm.torque", numbers);
    return read(Value(std::move(subscriptions)));
  };
  CHECK(with(Value(std::vector<double>{1, 2, 3, 0.5, 0.7}))->conflated == 2);
  CHECK_FALSE(with(Value("five")));
  CHECK_FALSE(with(Value(std::vector<double>{1, 2, 3, 4})));
  CHECK_FALSE(with(Value(std::vector<std::int32_t>{1, 2, 3, 4, 5})));
  CHECK_FALSE(with(Value(std::vector<double>{-1, 2, 3, 0.5, 0.7})));
  CHECK_FALSE(with(Value(std::vector<double>{1, std::nan(""), 3, 0.5, 0.7})));
  CHECK_FALSE(with(Value(std::vector<double>{1, 2, 1e300, 0.5, 0.7})));
}

TEST_CASE("attributes that cannot be read fail the request alone") {
  Subscriber pair;
  const auto id = pair.client->get_attributes(pair.now);
  pair.lose_requests();
  pair.forge(*pair.service, [id](Message& message) {
    message.begin_entry(EntryType::get_service_attributes_ret, "arm", {}, id);
    message.add_text("return", "many");
  });
  CHECK(pair.completion(id).error().code == ErrorCode::data_type_mismatch);
  CHECK(pair.client->state() == ClientState::connected);
}
