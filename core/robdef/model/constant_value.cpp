#include "core/robdef/model/constant_value.hpp"

#include <cmath>
#include <limits>
#include <set>
#include <utility>

#include "core/robdef/model/names.hpp"
#include "core/robdef/model/number_literal.hpp"
#include "core/support/utf8.hpp"
#include "core/support/words.hpp"

namespace rr {

namespace {

struct IntegerRange {
  std::uint64_t most_negative;  ///< magnitude
  std::uint64_t maximum;
};

IntegerRange integer_range(DataType type) {
  switch (type) {
    case DataType::int8_t:
      return {0x80u, 0x7fu};
    case DataType::uint8_t:
      return {0, 0xffu};
    case DataType::int16_t:
      return {0x8000u, 0x7fffu};
    case DataType::uint16_t:
      return {0, 0xffffu};
    case DataType::int32_t:
      return {0x80000000u, 0x7fffffffu};
    case DataType::uint32_t:
      return {0, 0xffffffffu};
    case DataType::int64_t:
      return {std::uint64_t{1} << 63, (std::uint64_t{1} << 63) - 1};
    default:
      return {0, std::numeric_limits<std::uint64_t>::max()};
  }
}

std::string range_text(DataType type) {
  const auto range = integer_range(type);
  return (range.most_negative == 0 ? std::string("0") : '-' + std::to_string(range.most_negative)) + " to " +
         std::to_string(range.maximum);
}

/// Reads one value; every function reports into `issues` and stops at the first fatal one.
class ValueReader {
 public:
  ValueReader(const TypeDefinition& type, std::string_view text, std::vector<ConstantIssue>& issues)
      : type_(type), text_(text), issues_(issues) {}

  ConstantValue read();

 private:
  void read_type();
  bool read_numbers(ConstantValue& out);
  bool read_number(std::size_t from, std::size_t to, ConstantValue& out);
  bool read_string(std::string& out);
  bool read_escape(std::string& out);
  bool read_code_unit(std::uint32_t& out);
  bool read_structure(std::vector<ConstantField>& out);
  void check_count(std::size_t count);

  bool is_real() const { return type_.type == DataType::double_t || type_.type == DataType::single_t; }
  void skip_blanks() {
    while (position_ < text_.size() && is_blank(text_[position_])) ++position_;
  }
  bool accept(char c) {
    if (position_ >= text_.size() || text_[position_] != c) return false;
    ++position_;
    return true;
  }
  std::string_view word() {
    const auto start = position_;
    while (position_ < text_.size() && is_word_character(text_[position_])) ++position_;
    return text_.substr(start, position_ - start);
  }
  bool fail(std::size_t from, std::size_t to, std::string_view code, std::string message) {
    issues_.push_back({false, std::string(code), std::move(message), from, to});
    return false;
  }
  bool fail_here(std::string_view expected) {
    const auto end = std::min(position_ + 1, text_.size());
    const auto found =
        position_ < text_.size() ? quote(text_.substr(position_, 1)) : std::string("the end of the value");
    return fail(position_, end, "constant-invalid", "found " + found + ", expected " + std::string(expected));
  }
  void relax(std::size_t from, std::size_t to, std::string_view code, std::string message) {
    issues_.push_back({true, std::string(code), std::move(message), from, to});
  }

  const TypeDefinition& type_;
  std::string_view text_;
  std::vector<ConstantIssue>& issues_;
  std::size_t position_ = 0;
};

ConstantValue ValueReader::read() {
  ConstantValue value;
  const bool is_struct = !type_.name.empty();
  const bool is_string = type_.type == DataType::string_t && !is_struct;
  if (type_.name == "structure" || (!is_struct && !is_string &&
                                    (!is_numeric(type_.type) || type_.type == DataType::bool_t ||
                                     type_.type == DataType::cdouble_t || type_.type == DataType::csingle_t))) {
    fail(0, 0, "constant-invalid",
         "a constant cannot have the type " + quote(format_type(type_)) + ", expected a number type, string or struct");
    return value;
  }
  const bool may_be_array = !is_struct && !is_string;
  if (type_.array == ArrayKind::multidim || type_.array == ArrayKind::fixed_multidim ||
      (type_.array != ArrayKind::none && !may_be_array)) {
    fail(
        0, 0, "constant-invalid",
        "a constant cannot have the array type " + quote(format_type(type_)) + ", expected numbers in [], [n] or [n-]");
    return value;
  }
  if (type_.container != ContainerKind::none) {
    const auto message = "a constant cannot have the container type " + quote(format_type(type_));
    if (may_be_array) {
      fail(0, 0, "constant-invalid", message);
      return value;
    }
    relax(0, 0, "constant-invalid", message);
  }
  bool is_good = true;
  if (is_struct) {
    is_good = read_structure(value.data.emplace<4>());
  } else if (is_string) {
    is_good = read_string(value.data.emplace<3>());
  } else {
    is_good = read_numbers(value);
  }
  skip_blanks();
  if (is_good && position_ < text_.size()) fail_here("the end of the value");
  return value;
}

bool ValueReader::read_numbers(ConstantValue& out) {
  if (is_real()) {
    out.data.emplace<2>();
  } else if (integer_range(type_.type).most_negative == 0) {
    out.data.emplace<1>();
  }
  out.is_array = type_.array != ArrayKind::none;
  if (!out.is_array) {
    position_ = text_.size();
    return read_number(0, text_.size(), out);
  }
  if (!accept('{')) return fail_here("'{' and the elements of the array");
  skip_blanks();
  std::size_t count = 0;
  if (!accept('}')) {
    while (true) {
      skip_blanks();
      const auto from = position_;
      position_ = std::min(text_.find_first_of(" \t,}", from), text_.size());
      if (!read_number(from, position_, out)) return false;
      ++count;
      skip_blanks();
      if (accept('}')) break;
      if (!accept(',')) return fail_here("',' or '}'");
    }
  }
  check_count(count);
  return true;
}

void ValueReader::check_count(std::size_t count) {
  if (type_.array == ArrayKind::variable || type_.sizes.empty()) return;
  const auto size = static_cast<std::size_t>(type_.sizes.front());
  if (type_.array == ArrayKind::fixed ? count == size : count <= size) return;
  relax(0, text_.size(), "constant-range",
        "found " + std::to_string(count) + " elements, expected " +
            (type_.array == ArrayKind::fixed ? "" : "at most ") + std::to_string(size));
}

bool ValueReader::read_number(std::size_t from, std::size_t to, ConstantValue& out) {
  const auto text = text_.substr(from, to - from);
  const auto found = "found " + (text.empty() ? std::string("nothing") : quote(text));
  if (is_real()) {
    if (!is_float_literal(text)) return fail(from, to, "constant-invalid", found + ", expected a decimal number");
    const double value = parse_float_literal(text, type_.type == DataType::single_t);
    if (std::isinf(value)) {
      return fail(from, to, "constant-range",
                  found + ", which is too large for " + std::string(builtin_type_word(type_.type)));
    }
    std::get<2>(out.data).push_back(value);
    return true;
  }
  IntegerLiteral literal;
  if (!parse_integer_literal(text, literal)) {
    return fail(from, to, "constant-invalid", found + ", expected a whole number such as -5 or 0x1f");
  }
  const auto range = integer_range(type_.type);
  const bool is_unsigned = range.most_negative == 0;
  const auto limit = literal.is_negative && !is_unsigned ? range.most_negative : range.maximum;
  const auto complaint =
      found + ", expected " + range_text(type_.type) + " for " + std::string(builtin_type_word(type_.type));
  if (literal.is_too_large || literal.magnitude > limit) return fail(from, to, "constant-range", complaint);
  const auto wrapped = literal.is_negative ? std::uint64_t{0} - literal.magnitude : literal.magnitude;
  if (is_unsigned) {
    if (literal.is_negative && literal.magnitude != 0) relax(from, to, "constant-range", complaint);
    std::get<1>(out.data).push_back(wrapped & range.maximum);
  } else {
    std::get<0>(out.data).push_back(static_cast<std::int64_t>(wrapped));
  }
  return true;
}

bool ValueReader::read_string(std::string& out) {
  if (!accept('"')) return fail_here("'\"' and a string");
  while (position_ < text_.size()) {
    const char c = text_[position_];
    if (c == '"') {
      ++position_;
      return true;
    }
    if (c == '\\') {
      if (!read_escape(out)) return false;
      continue;
    }
    if (c == '\t') {
      relax(position_, position_ + 1, "constant-invalid", "found a tab in a string, expected '\\t' for it");
    }
    out += c;
    ++position_;
  }
  return fail_here("'\"' at the end of the string");
}

bool ValueReader::read_code_unit(std::uint32_t& out) {
  const auto digits = text_.substr(position_ + 2, 4);
  out = 0;
  for (const char c : digits) {
    if (!is_hex_digit(c)) return false;
    out = out * 16 + static_cast<std::uint32_t>(is_digit(c) ? c - '0' : (c | 0x20) - 'a' + 10);
  }
  return digits.size() == 4;
}

bool ValueReader::read_escape(std::string& out) {
  constexpr std::string_view letters = "\"\\/bfnrt";
  constexpr std::string_view values = "\"\\/\b\f\n\r\t";
  const auto from = position_;
  const auto fail_escape = [&] {
    return fail(from, std::min(from + 2, text_.size()), "constant-invalid",
                "found the escape " + quote(text_.substr(from, 2)) +
                    R"(, expected one of \" \\ \/ \b \f \n \r \t or \u with four hex digits)");
  };
  if (from + 1 >= text_.size()) return fail_escape();
  const auto simple = letters.find(text_[from + 1]);
  if (simple != std::string_view::npos) {
    out += values[simple];
    position_ += 2;
    return true;
  }
  std::uint32_t code = 0;
  if (text_[from + 1] != 'u' || !read_code_unit(code)) return fail_escape();
  position_ += 6;
  const auto is_low = [](std::uint32_t unit) { return unit >= 0xdc00 && unit < 0xe000; };
  if (code >= 0xd800 && code < 0xdc00) {
    std::uint32_t low = 0;
    if (text_.substr(position_, 2) == "\\u" && read_code_unit(low) && is_low(low)) {
      position_ += 6;
      append_utf8(out, 0x10000 + ((code - 0xd800) << 10) + (low - 0xdc00));
      return true;
    }
  } else if (!is_low(code)) {
    append_utf8(out, code);
    return true;
  }
  relax(from, from + 6, "constant-invalid",
        "found half of a surrogate pair, " + std::string(text_.substr(from, 6)) + ", expected both halves");
  return true;
}

bool ValueReader::read_structure(std::vector<ConstantField>& out) {
  std::set<std::string_view> names;
  if (!accept('{')) return fail_here("'{' and the fields of the struct");
  skip_blanks();
  if (accept('}')) return true;
  while (true) {
    skip_blanks();
    const auto from = position_;
    const auto name = word();
    if (name.empty()) return fail_here("the name of a field");
    if (!is_name(name)) {
      return fail(from, position_, "name-invalid", "found " + quote(name) + ", expected the name of a field");
    }
    if (!names.insert(name).second) {
      relax(from, position_, "duplicate-name", "found the field " + quote(name) + " twice, expected it once");
    }
    skip_blanks();
    if (!accept(':')) return fail_here("':' after the field name");
    skip_blanks();
    const auto constant = word();
    if (!is_name(constant)) return fail_here("the name of a constant");
    out.push_back({std::string(name), std::string(constant)});
    skip_blanks();
    if (accept('}')) return true;
    if (!accept(',')) return fail_here("',' or '}'");
  }
}

}  // namespace

ConstantValue read_constant_value(const TypeDefinition& type, std::string_view text,
                                  std::vector<ConstantIssue>& issues) {
  return ValueReader(type, text, issues).read();
}

Result<ConstantValue> parse_constant_value(const TypeDefinition& type, std::string_view text, RobdefMode mode) {
  std::vector<ConstantIssue> issues;
  auto value = read_constant_value(type, trim(text), issues);
  for (const auto& issue : issues) {
    if (issue.is_relaxed && mode == RobdefMode::compat) continue;
    return make_error(ErrorCode::service_definition_error, "constant value: " + issue.message);
  }
  return value;
}

}  // namespace rr
