// Every message recorded from Robot Raconteur 1.2.8: decoded to its tree, and encoded to its bytes from the tree alone.

#include <catch2/catch.hpp>

#include "core/wire/codec.hpp"
#include "test/core/wire/message_tree.hpp"
#include "test/core/wire/vectors.hpp"
#include "test/support/print.hpp"

using namespace rr;
using namespace rr::test;

namespace {

/// Byte for byte what 1.2.8 wrote, except where it used a local string table: it puts every text there, ours those that
/// make the message smaller. Then it is the same message in no more bytes.
void check_encoded(const EncodedMessage& encoded, const MessageVector& vector) {
  const auto bytes = encoded.to_bytes();
  if (!vector.string_table.local) {
    CHECK(encoded.size() == vector.bytes.size());
    CHECK(to_hex(bytes) == to_hex(vector.bytes));
    return;
  }
  CHECK(encoded.size() <= vector.bytes.size());
  Message again;
  REQUIRE(decode(bytes, {.string_table = vector.string_table}, again));
  CHECK(compare_message(again, vector.tree) == "");
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

TEST_CASE("every recorded message is encoded byte for byte from its tree, or in fewer by its string table") {
  Message message;
  EncodedMessage encoded;
  for (const auto& vector : message_vectors()) {
    INFO(vector.name);
    build_message(vector.tree, message);
    REQUIRE(encode(message, {.string_table = vector.string_table}, encoded));
    check_encoded(encoded, vector);
  }
}

TEST_CASE("every recorded message survives decoding and encoding") {
  Message message;
  EncodedMessage encoded;
  for (const auto& vector : message_vectors()) {
    INFO(vector.name);
    REQUIRE(decode(vector.bytes, {.string_table = vector.string_table}, message));
    REQUIRE(encode(message, {.string_table = vector.string_table}, encoded));
    check_encoded(encoded, vector);
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
