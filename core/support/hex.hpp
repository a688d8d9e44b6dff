// Hex digits and %xx escapes. Layer: support.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>

namespace rr {

/// 0..15, or -1 for anything that is not a hex digit of either case.
constexpr int hex_value(char digit) {
  if (digit >= '0' && digit <= '9') return digit - '0';
  if (digit >= 'a' && digit <= 'f') return digit - 'a' + 10;
  if (digit >= 'A' && digit <= 'F') return digit - 'A' + 10;
  return -1;
}

/// The byte that the first two characters say, or -1.
constexpr int hex_byte(std::string_view text) {
  if (text.size() < 2 || hex_value(text[0]) < 0 || hex_value(text[1]) < 0) return -1;
  return hex_value(text[0]) << 4 | hex_value(text[1]);
}

inline constexpr std::string_view lower_hex_digits = "0123456789abcdef";
inline constexpr std::string_view upper_hex_digits = "0123456789ABCDEF";

/// The lowest `digits` hexadecimal digits of `value`: hex_text(10, 2) is "0a".
inline std::string hex_text(std::uint32_t value, int digits) {
  std::string text;
  for (int at = digits - 1; at >= 0; --at) text += lower_hex_digits[value >> (4 * at) & 15];
  return text;
}

/// Two lower-case digits for each byte.
inline std::string hex_text(std::span<const std::uint8_t> bytes) {
  std::string text;
  for (const auto byte : bytes) text += {lower_hex_digits[byte >> 4], lower_hex_digits[byte & 15]};
  return text;
}

/// Writes every byte for which `is_plain(char)` does not hold as '%' and two of `digits`.
template <class IsPlain>
std::string escape_bytes(std::string_view text, std::string_view digits, IsPlain is_plain) {
  std::string out;
  for (const char c : text) {
    if (is_plain(c)) {
      out += c;
    } else {
      const auto byte = static_cast<std::uint8_t>(c);
      out += '%';
      out += digits[byte >> 4];
      out += digits[byte & 15];
    }
  }
  return out;
}

}  // namespace rr
