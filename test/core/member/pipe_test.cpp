// One pipe endpoint: what is delivered, what waits, what is dropped; and the bytes of packets and acknowledgements.
#include "core/member/pipe.hpp"

#include <catch2/catch.hpp>

#include "core/wire/codec.hpp"
#include "test/support/print.hpp"

using namespace rr;

namespace {

const MemberDefinition samples{MemberKind::pipe, "samples", TypeDefinition{.type = DataType::double_t}};

/// An endpoint and what it has delivered.
struct Endpoint {
  explicit Endpoint(PipeStore& store, PipeState state = PipeState::open) : pipe(samples, store, state) {}
  Result<> receive(std::uint32_t number, std::size_t size_bytes = 100) {
    return pipe.receive({number, false, Value(static_cast<double>(number)), size_bytes}, deliver);
  }
  void open(bool is_unreliable = false) { pipe.open(is_unreliable, deliver); }

  PipeEndpointState pipe;
  std::vector<double> delivered;
  std::function<void(PipePacket&&)> deliver = [this](PipePacket&& packet) {
    delivered.push_back(packet.value.to<double>().value());
  };
};

using Numbers = std::vector<double>;

}  // namespace

TEST_CASE("packets are delivered in the order of their numbers, each once") {
  PipeStore store;
  Endpoint endpoint(store);
  REQUIRE(endpoint.receive(1));
  CHECK(endpoint.delivered == Numbers{1});
  REQUIRE(endpoint.receive(4));
  REQUIRE(endpoint.receive(3));
  CHECK(endpoint.delivered == Numbers{1});
  CHECK(store.bytes == 200);
  REQUIRE(endpoint.receive(3));  // repeated while it waits
  CHECK(store.bytes == 200);
  REQUIRE(endpoint.receive(2));
  CHECK(endpoint.delivered == Numbers{1, 2, 3, 4});
  CHECK(store.bytes == 0);
  REQUIRE(endpoint.receive(2));  // repeated after it was delivered
  REQUIRE(endpoint.receive(0));
  REQUIRE(endpoint.receive(5));
  CHECK(endpoint.delivered == Numbers{1, 2, 3, 4, 5});
}

TEST_CASE("an unreliable endpoint delivers what comes, as it comes") {
  PipeStore store;
  Endpoint endpoint(store, PipeState::connecting);
  endpoint.open(true);
  for (const std::uint32_t number : {7u, 2u, 2u, 100'000u}) REQUIRE(endpoint.receive(number));
  CHECK(endpoint.delivered == Numbers{7, 2, 2, 100'000});
}

TEST_CASE("packets that come before the endpoint is open are delivered when it opens") {
  PipeStore store;
  Endpoint endpoint(store, PipeState::connecting);
  REQUIRE(endpoint.receive(2));
  REQUIRE(endpoint.receive(1));
  REQUIRE(endpoint.receive(4));
  CHECK(endpoint.delivered.empty());
  SECTION("reliable") {
    endpoint.open();
    CHECK(endpoint.delivered == Numbers{1, 2});
    REQUIRE(endpoint.receive(3));
    CHECK(endpoint.delivered == Numbers{1, 2, 3, 4});
  }
  SECTION("unreliable") {
    endpoint.open(true);
    CHECK(endpoint.delivered == Numbers{1, 2, 4});
  }
  CHECK(store.bytes == 0);
}

TEST_CASE("a closing endpoint drops what comes") {
  PipeStore store;
  Endpoint endpoint(store);
  endpoint.pipe.start_closing();
  REQUIRE(endpoint.receive(1));
  CHECK(endpoint.delivered.empty());
}

TEST_CASE("what waits for a missing packet is bounded, by number and by bytes of all endpoints together") {
  PipeStore store{.max_bytes = 1000, .max_packets_ahead = 8};
  {
    Endpoint endpoint(store);
    REQUIRE(endpoint.receive(8));
    const auto refused = endpoint.receive(9);
    REQUIRE_FALSE(refused);
    CHECK(refused.error().code == ErrorCode::out_of_system_resource);
    CHECK(refused.error().message == "pipe 'samples': packet 9 came while 1 is missing; at most 8 may be kept");
    Endpoint other(store);
    REQUIRE(other.receive(2, 900));
    CHECK(endpoint.receive(2, 1).error().message ==
          "pipe 'samples': packets that wait for number 1 take more than 1000 bytes");
    REQUIRE(endpoint.receive(1, 1'000'000));  // it waits for nothing
    CHECK(endpoint.delivered == Numbers{1});
  }
  CHECK(store.bytes == 0);  // endpoints give back what they took
}

TEST_CASE("numbers begin with 1 and go on behind the largest") {
  PipeStore store;
  Endpoint endpoint(store);
  CHECK(endpoint.pipe.take_number() == 1);
  CHECK(endpoint.pipe.take_number() == 2);
  endpoint.pipe.return_number();
  CHECK(endpoint.pipe.take_number() == 2);
}

TEST_CASE("a packet is named by decimal text, an acknowledgement numbered; version 2 has text for both") {
  for (const std::uint16_t version : {std::uint16_t{2}, std::uint16_t{4}}) {
    Message message;
    message.header.version = version;
    message.begin_entry(EntryType::pipe_packet, "arm", "samples");
    const Value value(2.5);  // borrowed
    REQUIRE(write_pipe_packet(message, 12, 7, value, true, samples, {}));
    message.begin_entry(EntryType::pipe_packet_ret, "arm", "samples");
    write_pipe_ack(message, -3, 7);
    EncodedMessage encoded;
    REQUIRE(encode(message, {}, encoded));
    std::vector<std::uint8_t> bytes;
    for (const auto slice : encoded.slices()) bytes.insert(bytes.end(), slice.begin(), slice.end());
    Message read;
    REQUIRE(decode(bytes, {}, read));

    const auto& packet = *read.elements_of(read.entries[0]).begin();
    CHECK(packet.key_kind == KeyKind::name);
    CHECK(packet.name == "12");
    CHECK(read_pipe_index(packet).value() == 12);
    auto head = read_pipe_packet_head(read, packet, samples).value();
    CHECK(head.number == 7);
    CHECK(head.wants_ack);
    REQUIRE(read_pipe_packet_value(read, packet, samples, {}, head));
    CHECK(head.value == value);

    const auto& ack = *read.elements_of(read.entries[1]).begin();
    CHECK(ack.key_kind == (version == 4 ? KeyKind::number : KeyKind::name));
    CHECK(read_pipe_index(ack).value() == -3);
    CHECK(read_pipe_ack(ack).value() == std::vector<std::uint32_t>{7});
  }
}

TEST_CASE("packets that are none are refused with what was found") {
  Message message;
  message.begin_entry(EntryType::pipe_packet, "arm", "samples");
  const auto& text = message.add_text("one", "text");
  CHECK(read_pipe_index(text).error().message == "pipe: element 'one' does not name an endpoint");
  CHECK(read_pipe_packet_head(message, text, samples).error().message ==
        "pipe 'samples': a packet is a string, expected dictionary");
  CHECK(read_pipe_ack(text).error().message == "pipe: an acknowledgement is string, expected uint32");

  message.clear();
  message.begin_entry(EntryType::pipe_packet, "arm", "samples");
  message.begin_nested("1", DataType::map_string_t);
  message.end_nested();
  const auto& empty = *message.elements_of(message.entries[0]).begin();
  CHECK(read_pipe_packet_head(message, empty, samples).error().code == ErrorCode::message_element_not_found);
  PipePacket packet;
  CHECK(read_pipe_packet_value(message, empty, samples, {}, packet).error().code ==
        ErrorCode::message_element_not_found);
  CHECK(read_pipe_index_element(message, message.entries[0], samples).error().code ==
        ErrorCode::message_element_not_found);
}
