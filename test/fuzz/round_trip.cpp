#include "test/fuzz/round_trip.hpp"

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <cstring>

#include "test/core/wire/message_tree.hpp"
#include "test/support/format_message.hpp"

namespace rr::fuzz {

namespace {

void require(bool holds, const char* rule, const std::string& detail) {
  if (holds) return;
  std::fprintf(stderr, "broken: %s: %s\n", rule, detail.c_str());
  std::abort();
}

}  // namespace

void check_round_trip(ByteSpan input, std::uint16_t version, StringTableMode string_table) {
  if (input.size() < 16) return;
  Bytes bytes(input.begin(), input.end());
  const auto size = static_cast<std::uint32_t>(bytes.size());
  std::memcpy(bytes.data(), "RRAC", 4);
  std::memcpy(bytes.data() + 4, &size, sizeof(size));
  std::memcpy(bytes.data() + 8, &version, sizeof(version));

  static Message message;
  static Message again;
  static EncodedMessage encoded;
  const auto decoded = decode(bytes, {.string_table = string_table}, message);
  if (!decoded) {
    require(decoded.error().message.find(" at byte ") != std::string::npos, "an error names its offset",
            decoded.error().message);
    return;
  }
  (void)test::format_message(message);

  const auto done = encode(message, {.string_table = string_table}, encoded);
  if (!done) {
    require(message.entries.empty(), "what was decoded can be encoded", done.error().message);
    return;
  }
  const auto first = encoded.to_bytes();
  const auto decoded_again = decode(first, {.string_table = string_table}, again);
  require(decoded_again.has_value(), "what was encoded can be decoded",
          decoded_again ? std::string() : decoded_again.error().message);
  const auto difference = test::compare_messages(again, message);
  require(difference.empty(), "decoding gives back what was encoded", difference);
  require(encode(again, {.string_table = string_table}, encoded).has_value() && encoded.to_bytes() == first,
          "encoding is stable", test::format_message(again));

  // The other version carries it too, unless it uses what only version 4 has.
  message.header.version = version == 2 ? 4 : 2;
  if (encode(message, {}, encoded)) {
    const auto converted = encoded.to_bytes();
    require(decode(converted, {}, again).has_value(), "a converted message decodes", test::format_message(message));
  }
}

}  // namespace rr::fuzz
