// How sessions tell a slow peer from a dead one, and who may keep them waiting.
#include <catch2/catch.hpp>

#include <algorithm>

#include "test/core/session/loopback.hpp"
#include "test/support/print.hpp"

using namespace rr;
using namespace rr::test;

namespace {

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
