// Number literals, rounded once, in their own width. Layer: robdef.
// Source: service definitions spec sections 5.3, 5.5.2.
#include "core/robdef/model/number_literal.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

#include "core/robdef/model/names.hpp"

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

/// A whole number of any size.
class BigNumber {
 public:
  bool is_zero() const { return words_.empty(); }

  void multiply_add(std::uint32_t factor, std::uint32_t summand) {
    std::uint64_t carry = summand;
    for (auto& word : words_) {
      carry += std::uint64_t{word} * factor;
      word = static_cast<std::uint32_t>(carry);
      carry >>= 32;
    }
    if (carry != 0) words_.push_back(static_cast<std::uint32_t>(carry));
  }

  /// Returns  whether there is a remainder.
  bool divide(std::uint32_t divisor) {
    std::uint64_t rest = 0;
    for (auto word = words_.rbegin(); word != words_.rend(); ++word) {
      rest = rest << 32 | *word;
      *word = static_cast<std::uint32_t>(rest / divisor);
      rest %= divisor;
    }
    while (!words_.empty() && words_.back() == 0) words_.pop_back();
    return rest != 0;
  }

  /// Multiplies by 2^32 so many times.
  void shift_left(std::size_t words) { words_.insert(words_.begin(), words, 0); }

  std::int64_t bit_count() const {
    if (words_.empty()) return 0;
    return static_cast<std::int64_t>(words_.size()) * 32 - std::countl_zero(words_.back());
  }
  bool bit(std::int64_t position) const {
    return (words_[static_cast<std::size_t>(position / 32)] >> (position % 32) & 1) != 0;
  }

 private:
  std::vector<std::uint32_t> words_ = {};  ///< lowest first; the last is not 0
};

/// `number` * 10^`exponent`, rounded once to `precision` bits, none of them below 2^`lowest_bit`. Exact: neither the
/// locale nor the C library has a part in it.
double round_to_real(BigNumber number, std::int64_t exponent, std::int64_t precision, std::int64_t lowest_bit) {
  constexpr std::uint32_t billion = 1'000'000'000;
  for (; exponent >= 9; exponent -= 9) number.multiply_add(billion, 0);
  for (; exponent > 0; --exponent) number.multiply_add(10, 0);
  // The quotient keeps more bits than a double has: 10 is below 2^(32/9).
  const std::int64_t fraction_words = exponent < 0 ? 3 - exponent / 9 : 0;
  number.shift_left(static_cast<std::size_t>(fraction_words));
  bool has_rest = false;
  for (; exponent <= -9; exponent += 9) has_rest = number.divide(billion) || has_rest;
  for (; exponent < 0; ++exponent) has_rest = number.divide(10) || has_rest;

  const auto bits = number.bit_count();
  const auto unit = -32 * fraction_words;  // the power of two that bit 0 stands for
  const auto first = std::max({bits - precision, lowest_bit - unit, std::int64_t{0}});  // the lowest bit that is kept
  if (first > bits) return 0;
  std::uint64_t kept = 0;
  for (auto i = bits - 1; i >= first; --i) kept = kept << 1 | (number.bit(i) ? 1 : 0);
  for (std::int64_t i = 0; i + 1 < first && !has_rest; ++i) has_rest = number.bit(i);
  const bool is_half = first > 0 && number.bit(first - 1);
  if (is_half && (has_rest || (kept & 1) != 0)) ++kept;
  return std::ldexp(static_cast<double>(kept), static_cast<int>(first + unit));
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
  BigNumber number;
  std::size_t digit_count = 0;  // of `number`
  std::int64_t exponent = parts.exponent;
  bool has_more = false;
  const auto append = [&](std::string_view part, bool is_fraction) {
    for (const char c : part) {
      const bool is_kept = digit_count < max_significant_digits;
      if (is_kept) number.multiply_add(10, static_cast<std::uint32_t>(c - '0'));
      if (is_kept && !number.is_zero()) ++digit_count;
      if (!is_kept && c != '0') has_more = true;
      if (is_fraction && is_kept) --exponent;
      if (!is_fraction && !is_kept) ++exponent;
    }
  };
  append(parts.whole, false);
  append(parts.fraction, true);
  if (has_more) {
    number.multiply_add(10, 1);
    --exponent;
  }
  double value = 0;
  const auto magnitude = static_cast<std::int64_t>(digit_count) + exponent;  // below 10^magnitude
  if (!number.is_zero() && magnitude > 400) value = std::numeric_limits<double>::infinity();
  if (!number.is_zero() && magnitude >= -400 && magnitude <= 400)
    value = is_single ? round_to_real(std::move(number), exponent, 24, -149)
                      : round_to_real(std::move(number), exponent, 53, -1074);
  if (is_single && value > std::numeric_limits<float>::max()) value = std::numeric_limits<double>::infinity();
  return parts.is_negative ? -value : value;
}

}  // namespace rr
