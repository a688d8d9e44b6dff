// Memory: nothing allocated in the steady state, and never more than the bytes in hand justify.

#include <catch2/catch.hpp>

#include "core/wire/codec.hpp"
#include "core/wire/frame_scanner.hpp"
#include "test/core/wire/message_tree.hpp"
#include "test/core/wire/vectors.hpp"
#include "test/support/count_allocations.hpp"
#include "test/support/print.hpp"

using namespace rr;
using namespace rr::test;

TEST_CASE("the counter counts") {
  const auto before = allocation_count;
  const Bytes bytes(100);
  CHECK(allocation_count == before + 1);
}

TEST_CASE("decoding and encoding a small message allocates nothing once memory is warm") {
  for (const auto* name : {"property_get_request_v2", "property_get_request_v4", "wire_packet_v2", "wire_packet_v4",
                           "stringtable_both_wire_v4", "stringtable_local_struct_v4", "pack_varvalue_map_mixed_v2",
                           "pack_varvalue_map_mixed_v4", "pipe_packets_two_v4", "error_param_map_v2", "five_entries_v4",
                           "array_double_1000_v4"}) {
    INFO(name);
    const auto& vector = message_vector(name);
    const DecodeOptions decode_options{.string_table = vector.string_table};
    const EncodeOptions encode_options{.string_table = vector.string_table};
    Message message;
    EncodedMessage encoded;
    FrameScanner scanner;
    std::size_t warm_count = 0;
    bool succeeded = true;
    for (int round = 0; round < 10; ++round) {
      if (round == 1) warm_count = allocation_count;
      // Split, so that the scanner's buffer takes part.
      const ByteSpan bytes = vector.bytes;
      succeeded &= scanner.feed(bytes.first(20)).has_value() && scanner.feed(bytes.subspan(20)).has_value();
      succeeded &= scanner.message() && decode(*scanner.message(), decode_options, message).has_value();
      succeeded &= encode(message, encode_options, encoded).has_value();
    }
    const auto steady_count = allocation_count - warm_count;
    CHECK(succeeded);
    CHECK(steady_count == 0);
  }
}

TEST_CASE("building a small message allocates nothing once memory is warm") {
  Message message;
  EncodedMessage encoded;
  std::size_t warm_count = 0;
  for (int round = 0; round < 10; ++round) {
    if (round == 1) warm_count = allocation_count;
    message.clear();
    message.begin_entry(EntryType::wire_packet, "svc", "w1");
    message.begin_nested("packettime", DataType::structure_t, "RobotRaconteur.TimeSpec");
    message.add_scalar("seconds", DataType::int64_t, std::int64_t{1700000000});
    message.add_scalar("nanoseconds", DataType::int32_t, std::int32_t{500});
    message.end_nested();
    message.add_scalar("packet", DataType::double_t, 1.5);
    if (!encode(message, {.string_table = {.local = true, .standard = true}}, encoded)) FAIL("not encoded");
  }
  const auto steady_count = allocation_count - warm_count;
  CHECK(steady_count == 0);
}

TEST_CASE("no malformed message makes the decoder allocate more than its bytes justify") {
  for (const auto& vector : malformed_vectors()) {
    Message message;
    const auto before = allocated_bytes;
    const auto decoded = decode(vector.bytes, {.string_table = vector.string_table}, message);
    const auto allocated = allocated_bytes - before;
    INFO(vector.name << ": " << allocated << " bytes for " << vector.bytes.size());
    REQUIRE(decoded.has_value() == vector.accepted);
    // An element of 5 bytes becomes about 100, and a growing vector takes twice that and what it had before.
    CHECK(allocated <= 2000 + vector.bytes.size() * 60);
  }
}

TEST_CASE("the scanner's buffer grows with what arrived, not with what was announced") {
  const auto start = from_hex("52524143 0000c000 0400");  // 12 MiB
  FrameScanner scanner;
  auto before = allocated_bytes;
  REQUIRE(scanner.feed(start));
  CHECK(allocated_bytes - before <= 64);
  const Bytes chunk(1000);
  std::size_t fed = start.size();
  before = allocated_bytes;
  for (int i = 0; i < 100; ++i) fed += scanner.feed(chunk).value();
  CHECK(fed == 100'010);
  CHECK(allocated_bytes - before <= 4 * fed);
}

TEST_CASE("one large message costs for as long as it lasts") {
  Message message;
  EncodedMessage encoded;
  Message decoded;
  FrameScanner scanner;
  const auto send = [&](std::uint32_t elements) {
    message.clear();
    message.begin_entry(EntryType::function_call_req, "svc", "f");
    for (std::uint32_t i = 0; i < elements; ++i) message.add_scalar("value", DataType::uint32_t, i);
    REQUIRE(encode(message, {.string_table = {.local = true, .standard = true}}, encoded));
    const auto bytes = encoded.to_bytes();
    REQUIRE(scanner.feed(ByteSpan(bytes).first(20)));
    REQUIRE(scanner.feed(ByteSpan(bytes).subspan(20)));
    REQUIRE(decode(*scanner.message(), {.string_table = {.local = true, .standard = true}}, decoded));
    message.clear();
    encoded.clear();
    decoded.clear();
    scanner.release();
  };
  send(10);
  const auto before = live_bytes;
  send(100'000);
  CHECK(live_bytes <= before + 8 * max_kept_bytes);
  send(100);
  const auto warm = allocation_count;
  for (int i = 0; i < 10; ++i) send(100);
  CHECK(allocation_count - warm <= 10);  // that of to_bytes()
}
