#include <limits>
#include <utility>

#include "core/robdef/model/names.hpp"
#include "core/robdef/model/number_literal.hpp"
#include "core/robdef/parse/statement.hpp"

namespace rr {

namespace {

bool read_explicit_value(StatementReader& reader, EnumValueDefinition& out) {
  reader.skip_blanks();
  const auto start = reader.position();
  while (!reader.is_end() && !is_blank(reader.peek()) && reader.peek() != ',') reader.accept(reader.peek());
  const auto text = reader.text(start, reader.position());
  IntegerLiteral literal;
  if (!parse_integer_literal(text, literal)) {
    return reader.fail_at(start, reader.position(), "enum-invalid",
                          "found " + (text.empty() ? std::string("no value") : quote(text)) +
                              ", expected a whole number such as -5 or 0x1f");
  }
  const std::uint64_t limit = literal.is_negative ? 0x80000000u : 0x7fffffffu;
  if (literal.is_too_large || literal.magnitude > limit) {
    return reader.fail_at(start, reader.position(), "enum-invalid",
                          "found " + quote(text) + ", expected -2147483648 to 2147483647");
  }
  const auto magnitude = static_cast<std::int64_t>(literal.magnitude);
  out.value = static_cast<std::int32_t>(literal.is_negative ? -magnitude : magnitude);
  out.is_hex = literal.is_hex;
  return true;
}

}  // namespace

bool EnumReader::read_item(StatementReader& reader, std::string& documentation) {
  const auto start = reader.position();
  EnumValueDefinition item;
  item.line = reader.line().line();
  item.documentation = std::exchange(documentation, {});
  if (!reader.expect_word("the name of an enum value", item.name)) return false;
  const auto end = reader.position();
  reader.skip_blanks();
  if (reader.accept('=')) {
    if (!read_explicit_value(reader, item)) has_bad_count_ = true;
  } else {
    item.is_implicit = true;
    count_on(reader, start, end, item);
  }
  out_->values.push_back(std::move(item));
  return true;
}

/// Reports only the first value that cannot be counted: the later ones follow from it.
void EnumReader::count_on(StatementReader& reader, std::size_t start, std::size_t end, EnumValueDefinition& item) {
  if (has_bad_count_) return;
  if (out_->values.empty()) {
    has_bad_count_ = true;
    reader.fail_at(start, end, "enum-invalid",
                   "found no value for " + quote(item.name) + ", expected one: it is the first");
    return;
  }
  const auto& previous = out_->values.back();
  if (previous.value == std::numeric_limits<std::int32_t>::max()) {
    has_bad_count_ = true;
    reader.fail_at(start, end, "enum-invalid", "the value of " + quote(item.name) + " would be above 2147483647");
    return;
  }
  item.value = previous.value + 1;
  item.is_hex = previous.is_hex;
}

void EnumReader::read_line(StatementReader& reader, std::string documentation) {
  reader.skip_blanks();
  const bool is_after_gap = std::exchange(is_comma_due_, false);
  if (is_after_gap) {
    reader.fail("',' at the end of the line before, or the end of the enum");
    return;
  }
  while (true) {
    if (!read_item(reader, documentation)) return;
    reader.skip_blanks();
    if (reader.is_end()) {
      is_comma_due_ = true;
      return;
    }
    if (!reader.accept(',')) {
      reader.fail("',' or '='");
      return;
    }
    bool has_more_commas = false;
    while (reader.accept(',')) has_more_commas = true;
    reader.skip_blanks();
    if (reader.is_end()) return;
    if (has_more_commas || reader.peek() == ',') {
      reader.fail("the end of the line after commas");
      return;
    }
  }
}

}  // namespace rr
