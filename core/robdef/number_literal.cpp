// Number literals, independent of the locale and rounded once, in their own width. Layer: robdef.
// Source: service definitions spec sections 5.3, 5.5.2.
#include "core/robdef/number_literal.hpp"

#include <algorithm>
#include <cstdlib>
#include <limits>
#include <string>

#include "core/robdef/constant_value.hpp"
#include "core/robdef/names.hpp"

namespace rr {

namespace {

/// Decides every rounding of a double (767 digits at most matter) together with one sticky digit.
constexpr std::size_t max_significant_digits = 800;

struct FloatParts {
  bool is_negative = false;
  std::string_view whole = {};
  std::string_view fraction = {};
  std::int64_t exponent = 0;
};

std::string_view read_digits(std::string_view text, std::size_t& position) {
  const auto start = position;
  while (position < text.size() && is_digit(text[position])) ++position;
  return text.substr(start, position - start);
}

bool read_exponent(std::string_view text, std::size_t& position, std::int64_t& out) {
  if (position >= text.size() || (text[position] != 'e' && text[position] != 'E')) return true;
  ++position;
  bool is_negative = false;
  if (position < text.size() && (text[position] == '+' || text[position] == '-')) is_negative = text[position++] == '-';
  const auto digits = read_digits(text, position);
  // Far beyond every length of text that counts against it.
  constexpr std::int64_t limit = std::int64_t{1} << 40;
  for (const char c : digits) out = std::min(out * 10 + (c - '0'), limit);
  if (is_negative) out = -out;
  return !digits.empty();
}

bool split_float(std::string_view text, FloatParts& out) {
  std::size_t position = 0;
  if (!text.empty() && (text[0] == '+' || text[0] == '-')) out.is_negative = text[position++] == '-';
  out.whole = read_digits(text, position);
  if (out.whole.size() > 1 && out.whole.front() == '0') return false;
  if (position < text.size() && text[position] == '.') {
    ++position;
    out.fraction = read_digits(text, position);
    if (out.whole.empty() && out.fraction.empty()) return false;
  } else if (out.whole.empty()) {
    return false;
  }
  return read_exponent(text, position, out.exponent) && position == text.size();
}

/// The same number as "DDDe±N": without a decimal point there is nothing a locale could change.
std::string normalised(const FloatParts& parts) {
  std::string digits;
  std::int64_t exponent = parts.exponent;
  bool has_more = false;
  const auto append = [&](std::string_view part, bool is_fraction) {
    for (const char c : part) {
      const bool is_leading_zero = digits.empty() && c == '0';
      const bool is_kept = digits.size() < max_significant_digits;
      if (!is_leading_zero && is_kept) digits += c;
      if (!is_kept && c != '0') has_more = true;
      if (is_fraction && (is_leading_zero || is_kept)) --exponent;
      if (!is_fraction && !is_leading_zero && !is_kept) ++exponent;
    }
  };
  append(parts.whole, false);
  append(parts.fraction, true);
  if (digits.empty()) digits = "0";
  if (has_more) {
    digits += '1';
    --exponent;
  }
  exponent = std::clamp<std::int64_t>(exponent, -100000, 100000);
  return (parts.is_negative ? "-" : "") + digits + 'e' + std::to_string(exponent);
}

}  // namespace

bool parse_integer_literal(std::string_view text, IntegerLiteral& out) {
  out = {};
  if (!text.empty() && (text[0] == '+' || text[0] == '-')) {
    out.is_negative = text[0] == '-';
    text.remove_prefix(1);
  }
  out.is_hex = text.starts_with("0x");
  if (out.is_hex) text.remove_prefix(2);
  if (text.empty() || (!out.is_hex && text.size() > 1 && text[0] == '0')) return false;
  const std::uint64_t base = out.is_hex ? 16 : 10;
  for (const char c : text) {
    if (out.is_hex ? !is_hex_digit(c) : !is_digit(c)) return false;
    const auto digit = static_cast<std::uint64_t>(is_digit(c) ? c - '0' : (c | 0x20) - 'a' + 10);
    if (out.magnitude > (std::numeric_limits<std::uint64_t>::max() - digit) / base) {
      out.is_too_large = true;
    } else {
      out.magnitude = out.magnitude * base + digit;
    }
  }
  return true;
}

bool is_float_literal(std::string_view text) {
  FloatParts parts;
  return split_float(text, parts);
}

bool is_number_literal(std::string_view text) {
  IntegerLiteral integer;
  return parse_integer_literal(text, integer) || is_float_literal(text);
}

double parse_float_literal(std::string_view text, bool is_single) {
  FloatParts parts;
  split_float(text, parts);
  const auto plain = normalised(parts);
  return is_single ? static_cast<double>(std::strtof(plain.c_str(), nullptr)) : std::strtod(plain.c_str(), nullptr);
}

}  // namespace rr
