// Every malformed or unusual message: verdict, error class, and an error text that names a field and an offset.

#include <algorithm>
#include <catch2/catch.hpp>

#include "core/wire/codec.hpp"
#include "core/wire/frame_scanner.hpp"
#include "test/core/wire/message_tree.hpp"
#include "test/core/wire/vectors.hpp"
#include "test/support/print.hpp"

using namespace rr;
using namespace rr::test;

namespace {

/// What a connection does with a stream that then ends: scan, decode, at the end look whether a message was cut.
/// `input` comes in two pieces.
Result<> receive(ByteSpan input, std::size_t split, StringTableMode string_table, Message& message) {
  FrameScanner scanner;
  bool has_message = false;
  for (auto piece : {input.first(split), input.subspan(split)}) {
    while (!piece.empty()) {
      const auto consumed = scanner.feed(piece);
      if (!consumed) return consumed.error();
      piece = piece.subspan(*consumed);
      if (!scanner.message()) continue;
      if (auto decoded = decode(*scanner.message(), {.string_table = string_table}, message); !decoded) return decoded;
      has_message = true;
      if (!piece.empty()) return protocol_error("message at byte 0: more bytes follow");
    }
  }
  if (!has_message) return make_error(ErrorCode::connection_error, "message at byte 0: the stream ends inside it");
  return {};
}

/// "<field> at byte <number>: <what is wrong>"
bool names_field_and_offset(const std::string& text) {
  const auto at = text.find(" at byte ");
  if (at == std::string::npos || at == 0) return false;
  const auto number = at + 9;
  const auto colon = text.find_first_not_of("0123456789", number);
  return colon != std::string::npos && colon > number && text.compare(colon, 2, ": ") == 0 && colon + 2 < text.size();
}

}  // namespace

TEST_CASE("every malformed message gets its verdict, wherever the stream is split") {
  REQUIRE(malformed_vectors().size() == 497);
  Message message;
  for (const auto& vector : malformed_vectors()) {
    const auto size = vector.bytes.size();
    const std::size_t step = size > 1'000'000 ? size / 4 : size > 4000 ? size / 40 : 1;
    for (std::size_t split = 0; split <= size; split += step) {
      INFO(vector.name << " split at " << split);
      const auto received = receive(vector.bytes, split, vector.string_table, message);
      INFO((received ? std::string() : received.error().message));
      REQUIRE(received.has_value() == vector.accepted);
      if (received) continue;
      REQUIRE(received.error().code == vector.error);
      REQUIRE(names_field_and_offset(received.error().message));
      REQUIRE(received.error().message.size() < 300);
    }
  }
}

TEST_CASE("unusual but legal messages come out of an encoder in their normal form and mean the same") {
  Message message;
  Message again;
  EncodedMessage encoded;
  for (const auto& vector : malformed_vectors()) {
    if (!vector.accepted) continue;
    INFO(vector.name);
    REQUIRE(decode(vector.bytes, {.string_table = vector.string_table}, message));
    REQUIRE(encode(message, {.string_table = vector.string_table}, encoded));
    const auto bytes = encoded.to_bytes();
    REQUIRE(decode(bytes, {.string_table = vector.string_table}, again));
    CHECK(compare_messages(again, message) == "");
  }
}
