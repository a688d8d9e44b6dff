// Every message recorded from Robot Raconteur 1.2.8: decoded to its tree, and encoded to its bytes from the tree alone.

#include <algorithm>
#include <catch2/catch.hpp>

#include "core/wire/byte_reader.hpp"
#include "core/wire/codec.hpp"
#include "test/core/wire/message_tree.hpp"
#include "test/core/wire/vectors.hpp"
#include "test/support/print.hpp"

using namespace rr;
using namespace rr::test;

namespace {

/// The order inside a local string table is free: sorts its entries by code, so that two messages which differ in
/// nothing else get the same bytes. Version 2 and messages without a table stay as they are.
Bytes with_sorted_table(const Bytes& bytes) {
  if (bytes[8] != 4) return bytes;
  ByteReader in(bytes);
  in.bytes(10, "start");
  in.uint_x("HeaderSize");
  const auto flags = in.number<std::uint8_t>("MessageFlags");
  if ((flags & 0x20) == 0) return bytes;
  if ((flags & 0x01) != 0) {
    in.bytes(32, "ids");
    in.text_x("name");
    in.text_x("name");
  }
  if ((flags & 0x02) != 0) {
    in.uint_x("endpoint");
    in.uint_x("endpoint");
  }
  if ((flags & 0x04) != 0) in.bytes(2, "priority");
  if ((flags & 0x10) != 0) {
    in.text_x("metadata");
    in.bytes(4, "ids");
  }
  struct Row {
    std::uint32_t code;
    ByteSpan bytes;
  };
  std::vector<Row> rows(in.uint_x("count"));
  const auto table_start = in.at();
  for (auto& row : rows) {
    const auto start = in.at();
    row.code = in.uint_x("code");
    in.text_x("text");
    row.bytes = ByteSpan(bytes).subspan(start, in.at() - start);
  }
  REQUIRE(in.ok());
  std::sort(rows.begin(), rows.end(), [](const Row& a, const Row& b) { return a.code < b.code; });
  Bytes sorted(bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(table_start));
  for (const auto& row : rows) sorted.insert(sorted.end(), row.bytes.begin(), row.bytes.end());
  sorted.insert(sorted.end(), bytes.begin() + static_cast<std::ptrdiff_t>(in.at()), bytes.end());
  return sorted;
}

}  // namespace

TEST_CASE("every recorded message decodes to its tree") {
  REQUIRE(message_vectors().size() == 744);
  Message message;
  for (const auto& vector : message_vectors()) {
    INFO(vector.name);
    REQUIRE(decode(vector.bytes, {.string_table = vector.string_table}, message));
    CHECK(compare_message(message, vector.tree) == "");
  }
}

TEST_CASE("every recorded message is encoded byte for byte from its tree") {
  Message message;
  EncodedMessage encoded;
  for (const auto& vector : message_vectors()) {
    INFO(vector.name);
    build_message(vector.tree, message);
    REQUIRE(encode(message, {.string_table = vector.string_table}, encoded));
    CHECK(encoded.size() == vector.bytes.size());
    CHECK(to_hex(with_sorted_table(encoded.to_bytes())) == to_hex(with_sorted_table(vector.bytes)));
  }
}

TEST_CASE("every recorded message survives decoding and encoding") {
  Message message;
  EncodedMessage encoded;
  for (const auto& vector : message_vectors()) {
    INFO(vector.name);
    REQUIRE(decode(vector.bytes, {.string_table = vector.string_table}, message));
    REQUIRE(encode(message, {.string_table = vector.string_table}, encoded));
    CHECK(to_hex(with_sorted_table(encoded.to_bytes())) == to_hex(with_sorted_table(vector.bytes)));
  }
}

TEST_CASE("a message forwarded without a string table carries no codes") {
  Message message;
  Message forwarded;
  EncodedMessage encoded;
  for (const auto& vector : message_vectors()) {
    if (!vector.string_table.is_active()) continue;
    INFO(vector.name);
    REQUIRE(decode(vector.bytes, {.string_table = vector.string_table}, message));
    REQUIRE(encode(message, {}, encoded));
    const auto bytes = encoded.to_bytes();
    REQUIRE(decode(bytes, {}, forwarded));
    CHECK(compare_messages(forwarded, message) == "");
  }
}

TEST_CASE("every truncation of a recorded message is refused") {
  Message message;
  for (const auto& vector : message_vectors()) {
    const std::size_t step = vector.bytes.size() > 4000 ? vector.bytes.size() / 500 : 1;
    for (std::size_t size = 0; size < vector.bytes.size(); size += step) {
      INFO(vector.name << " cut after " << size);
      // The announced size is larger than what is there.
      Bytes cut(vector.bytes.begin(), vector.bytes.begin() + static_cast<std::ptrdiff_t>(size));
      const auto ended = decode(cut, {.string_table = vector.string_table}, message);
      REQUIRE_FALSE(ended);
      REQUIRE(ended.error().code == ErrorCode::connection_error);
      REQUIRE(message.entries.empty());
      // The announced size is that of the rest.
      if (size < 10) continue;
      const auto announced = static_cast<std::uint32_t>(size);
      std::memcpy(cut.data() + 4, &announced, sizeof(announced));
      const auto refused = decode(cut, {.string_table = vector.string_table}, message);
      REQUIRE_FALSE(refused);
      REQUIRE((refused.error().code == ErrorCode::protocol_error ||
               refused.error().code == ErrorCode::data_serialization_error));
      REQUIRE(message.entries.empty());
      REQUIRE(message.elements.empty());
    }
  }
}
