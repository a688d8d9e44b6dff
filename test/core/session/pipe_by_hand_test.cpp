// Pipes of a client whose service does what ours does not: it is written by hand.
#include <catch2/catch.hpp>

#include "test/core/session/pipe_messages.hpp"
#include "test/support/print.hpp"

using namespace rr;
using namespace rr::test;

namespace {

/// A service by hand: it answers nothing by itself.
class ByHand {
 public:
  ByHand() { pair.connect(); }

  void say(const std::function<void(Message&)>& write) {
    pair.client->handle_bytes(encode_from(pair.client->connection(), write), pair.now);
  }
  void say_packet(std::int32_t index, std::uint32_t number, double value, std::string_view pipe = "samples") {
    say([&](Message& message) {
      message.begin_entry(EntryType::pipe_packet, "arm", pipe);
      add_packet(message, index, number, value);
    });
  }
  void say_connected(RequestId request, std::int32_t index) {
    say([&](Message& message) {
      message.begin_entry(EntryType::pipe_connect_ret, "arm", "samples", request);
      write_pipe_index(message, index);
    });
  }
  void say_closed(std::int32_t index) {
    say([&](Message& message) {
      message.begin_entry(EntryType::pipe_closed, "arm", "samples");
      write_pipe_index(message, index);
    });
  }
  /// What the client sends, one line a message: type, and the elements' names.
  std::vector<std::string> heard() {
    std::vector<std::string> lines;
    for_each_heard([&](const Message& message, const MessageEntry& entry) {
      std::string line(entry_type_name(entry.type));
      for (const auto& element : message.elements_of(entry))
        line += " " + (element.key_kind == KeyKind::name ? std::string(element.name) : std::to_string(element.number));
      lines.push_back(line);
    });
    return lines;
  }
  /// Of the one request that the client sends.
  std::int32_t asked_index() {
    std::vector<std::int32_t> asked;
    for_each_heard([&](const Message& message, const MessageEntry& entry) {
      asked.push_back(read_pipe_index_element(message, entry, {MemberKind::pipe, "samples", {}}).value());
    });
    REQUIRE(asked.size() == 1);
    return asked.front();
  }
  void expect_packet(std::int32_t index, double value) {
    const auto packet = pair.next_client<PipePacketReceived>();
    CHECK(packet.path == "arm");
    CHECK(packet.member == "samples");
    CHECK(packet.index == index);
    CHECK(packet.value == Value(value));
  }
  void expect_connected(RequestId request, std::int32_t index) {
    const auto done = pair.next_client<Completed>();
    CHECK(done.id == request);
    CHECK(done.result.value() == Value(index));
  }
  RequestId connect(std::int32_t index = any_pipe_index) {
    const auto id = pair.client->connect_pipe("arm", "samples", index, pair.now);
    CHECK(heard() == Lines{"PipeConnectReq index"});
    return id;
  }

  void for_each_heard(const std::function<void(const Message&, const MessageEntry&)>& take) {
    Bytes bytes;
    for (const auto slice : pair.client->poll_transmit()) bytes.insert(bytes.end(), slice.begin(), slice.end());
    pair.client->handle_transmitted(bytes.size(), pair.now);
    FrameScanner scanner(1u << 20);
    for (ByteSpan left = bytes; !left.empty();) {
      left = left.subspan(scanner.feed(left).value());
      if (!scanner.message()) continue;
      Message message;
      decode(*scanner.message(), {}, message).value();
      for (const auto& entry : message.entries) take(message, entry);
    }
  }

  using Lines = std::vector<std::string>;
  Loopback pair{[] {
    Features features;
    features.string_table = {.local = false, .standard = false};
    return features;
  }()};
};

using Lines = ByHand::Lines;

}  // namespace

TEST_CASE("however many endpoints are open, the next one keeps the packets that come before its reply") {
  ByHand by_hand;
  for (std::int32_t index = 1; index <= 70; ++index) {
    const auto request = by_hand.connect();
    by_hand.say_packet(index, 1, index);
    by_hand.say_connected(request, index);
    by_hand.expect_connected(request, index);
    by_hand.expect_packet(index, index);
  }
}

TEST_CASE("any index is one that the session has not had, since a service may still send to the endpoint before") {
  ByHand by_hand;
  auto& client = *by_hand.pair.client;
  const auto ask = [&](std::int32_t index = any_pipe_index) {
    const auto request = client.connect_pipe("arm", "samples", index, by_hand.pair.now);
    return std::pair(request, by_hand.asked_index());
  };
  const auto [first, any] = ask();
  CHECK(any == any_pipe_index);
  by_hand.say_connected(first, 1);
  by_hand.expect_connected(first, 1);
  by_hand.say_closed(1);
  by_hand.pair.next_client<PipeClosedByService>();
  CHECK(ask().second == 2);
  const auto [third, next] = ask();
  CHECK(next == 3);  // also while the second is not there yet
  by_hand.say_connected(third, 7);
  by_hand.expect_connected(third, 7);
  CHECK(ask().second == 8);
  CHECK(ask(4).second == 4);
  CHECK(ask(INT32_MAX).second == INT32_MAX);
  CHECK(ask().second == any_pipe_index);  // there is none above
}

TEST_CASE("a service's packets in the wrong order, repeated, and for endpoints that nobody knows") {
  ByHand service;
  const auto request = service.connect();
  service.say_connected(request, 1);
  service.expect_connected(request, 1);
  service.say_packet(1, 2, 2.0);
  service.say_packet(1, 3, 3.0);
  service.say_packet(9, 1, 9.0);
  CHECK_FALSE(service.pair.client->poll_event());
  service.say_packet(1, 1, 1.0);
  service.say_packet(1, 2, 2.0);
  service.expect_packet(1, 1.0);
  service.expect_packet(1, 2.0);
  service.expect_packet(1, 3.0);
  CHECK_FALSE(service.pair.client->poll_event());
  CHECK(service.heard().empty());
}

TEST_CASE("packets before the connect reply wait for it, whatever index it names") {
  ByHand service;
  const auto request = service.connect(5);
  service.say_packet(11, 2, 2.0);
  service.say_packet(11, 1, 1.0);
  service.say_packet(5, 1, 5.0);  // of an endpoint that does not come to be
  CHECK_FALSE(service.pair.client->poll_event());
  service.say_connected(request, 11);
  service.expect_connected(request, 11);
  service.expect_packet(11, 1.0);
  service.expect_packet(11, 2.0);
  service.say_packet(5, 2, 6.0);
  CHECK_FALSE(service.pair.client->poll_event());
}

TEST_CASE("an endpoint that is closed before its connect reply opens and closes") {
  ByHand service;
  const auto request = service.connect();
  service.say_packet(1, 1, 1.0);
  service.say_closed(1);
  service.say_connected(request, 1);
  service.expect_connected(request, 1);
  service.expect_packet(1, 1.0);
  CHECK(service.pair.next_client<PipeClosedByService>().index == 1);
}

TEST_CASE("several packets in one entry reach several endpoints, and are acknowledged together") {
  ByHand service;
  for (const std::int32_t index : {1, 2}) {
    const auto request = service.connect();
    service.say_connected(request, index);
    service.expect_connected(request, index);
  }
  service.say([&](Message& message) {
    message.begin_entry(EntryType::pipe_packet, "arm", "samples");
    for (const std::int32_t index : {2, 7, 1}) add_packet(message, index, 1, 1.0 * index, true);
  });
  service.expect_packet(2, 2.0);
  service.expect_packet(1, 1.0);
  CHECK(service.heard() == Lines{"PipePacketRet 2 1"});
}

TEST_CASE("a packet that can never be made up for closes the endpoint on both sides") {
  ByHand service;
  const auto request = service.connect();
  service.say_connected(request, 1);
  service.expect_connected(request, 1);
  SECTION("too far ahead") {
    service.say_packet(1, 5000, 1.0);
  }
  SECTION("of another type") {
    service.say([&](Message& message) {
      message.begin_entry(EntryType::pipe_packet, "arm", "samples");
      message.begin_nested("1", DataType::map_string_t);
      message.add_scalar("packetnumber", DataType::uint32_t, std::uint32_t{1});
      message.add_text("packet", "text");
      message.end_nested();
    });
  }
  CHECK(service.pair.next_client<PipeClosedByService>().index == 1);
  CHECK(service.heard() == Lines{"PipeDisconnectReq index"});
  service.say_packet(1, 1, 1.0);
  CHECK_FALSE(service.pair.client->poll_event());
}

TEST_CASE("a connect reply that comes too late closes the endpoint that it names") {
  ByHand service;
  const auto request = service.connect();
  SECTION("after its time") {
    service.pair.advance(std::chrono::seconds(16));
    service.pair.client->handle_timeout(service.pair.now);
    CHECK(service.pair.next_client<Completed>().result.error().code == ErrorCode::request_timeout);
    (void)service.heard();  // a heartbeat
  }
  SECTION("after it was cancelled") {
    service.pair.client->cancel(request);
  }
  service.say_connected(request, 4);
  CHECK(service.heard() == Lines{"PipeDisconnectReq index"});
  CHECK_FALSE(service.pair.client->poll_event());
}

TEST_CASE("a request that nobody waits for is forgotten in the end") {
  ByHand service;
  service.pair.client->cancel(service.connect());
  CHECK(service.pair.client->pending_requests() == 1);
  service.pair.advance(std::chrono::seconds(16 + 60));
  service.pair.client->handle_timeout(service.pair.now);
  CHECK(service.pair.client->pending_requests() == 0);
  CHECK_FALSE(service.pair.client->poll_event());
}
