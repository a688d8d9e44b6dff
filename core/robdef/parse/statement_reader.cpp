#include "core/robdef/parse/statement_reader.hpp"

#include <algorithm>
#include <utility>

#include "core/robdef/model/names.hpp"
#include "core/support/words.hpp"

namespace rr {

namespace {

template <class Predicate>
std::string_view read_while(std::string_view text, std::size_t& position, Predicate predicate) {
  const auto start = position;
  while (position < text.size() && predicate(text[position])) ++position;
  return text.substr(start, position - start);
}

}  // namespace

bool StatementReader::skip_blanks() {
  return !read_while(text_, position_, is_blank).empty();
}

bool StatementReader::accept(char c) {
  if (is_end() || text_[position_] != c) return false;
  ++position_;
  return true;
}

std::string_view StatementReader::word() {
  return read_while(text_, position_, is_word_character);
}

std::string_view StatementReader::dotted_word() {
  return read_while(text_, position_, [](char c) { return is_word_character(c) || c == '.'; });
}

std::string_view StatementReader::token() {
  return read_while(text_, position_, [](char c) { return !is_blank(c); });
}

std::string_view StatementReader::rest(std::size_t& from) {
  skip_blanks();
  from = position_;
  position_ = text_.size();
  return trim(text_.substr(from));
}

bool StatementReader::expect_blank(std::string_view expected) {
  if (!is_end() && !is_blank(peek())) return fail("a blank and " + std::string(expected));
  skip_blanks();
  return is_end() ? fail(expected) : true;
}

bool StatementReader::expect_word(std::string_view expected, std::string& out) {
  const auto found = word();
  if (found.empty()) return fail(expected);
  out = found;
  return true;
}

bool StatementReader::expect_end(std::string_view expected) {
  skip_blanks();
  if (is_end()) return true;
  return fail(std::string(expected) + (peek() == '#' ? " (comments take lines of their own)" : ""));
}

bool StatementReader::has_room(std::size_t count, std::size_t most) {
  return count < most || fail("at most " + std::to_string(most) + " of these");
}

bool StatementReader::fail(std::string_view expected) {
  auto end = position_;
  if (!is_end()) {
    read_while(text_, end, is_word_character);
    if (end == position_) ++end;
  }
  const auto found = is_end() ? std::string("the end of the statement") : quote(text(position_, end));
  return fail_at(position_, end, "syntax", "found " + found + ", expected " + std::string(expected));
}

bool StatementReader::fail_at(std::size_t from, std::size_t to, std::string_view code, std::string message) {
  reporter_->error(code, span(from, to), std::move(message));
  return false;
}

}  // namespace rr
