// Whole numbers in decimal text. Layer: support.
#pragma once

#include <charconv>
#include <concepts>
#include <optional>
#include <string>
#include <string_view>

namespace rr {

/// The number that all of `text` says: decimal digits, after a '-' where T has a sign. "007" is one, "+7" and " 7" are
/// none, nor is what T can't hold.
template <std::integral T>
std::optional<T> whole_number(std::string_view text) {
  T number = 0;
  const auto* end = text.data() + text.size();
  const auto [stop, error] = std::from_chars(text.data(), end, number);
  if (error != std::errc() || stop != end) return std::nullopt;
  return number;
}

/// The same, in its one spelling: neither "007" nor "-0".
template <std::integral T>
std::optional<T> canonical_number(std::string_view text) {
  const auto number = whole_number<T>(text);
  return number && std::to_string(*number) == text ? number : std::nullopt;
}

}  // namespace rr
