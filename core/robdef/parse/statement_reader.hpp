// Reads the words of one logical line and reports where it goes wrong. Layer: robdef.
// Source: service definitions spec sections 5.3, 5.8.
#pragma once

#include <string>
#include <string_view>

#include "core/robdef/model/reporter.hpp"
#include "core/robdef/parse/lexer.hpp"

namespace rr {

/// `line` and `reporter` are borrowed for life. A statement reports one error: parsing it ends there.
class StatementReader {
 public:
  StatementReader(const LogicalLine& line, Reporter& reporter, std::size_t position = 0)
      : line_(&line), reporter_(&reporter), text_(line.text()), position_(position) {}

  Reporter& reporter() const { return *reporter_; }
  const LogicalLine& line() const { return *line_; }
  std::size_t position() const { return position_; }
  bool is_end() const { return position_ >= text_.size(); }
  /// NUL at the end: the text itself holds none.
  char peek() const { return is_end() ? '\0' : text_[position_]; }
  std::string_view ahead() const { return text_.substr(position_); }
  std::string_view text(std::size_t from, std::size_t to) const { return text_.substr(from, to - from); }
  SourceSpan span(std::size_t from, std::size_t to) const { return line_->span(from, to); }

  /// Whether there was a blank.
  bool skip_blanks();
  bool accept(char c);
  /// Letters, digits and underscores from here on; may be empty.
  std::string_view word();
  /// As word(), with dots.
  std::string_view dotted_word();
  /// Everything up to the next blank.
  std::string_view token();
  /// Everything that is left, without outer blanks. `from` is set to where it starts.
  std::string_view rest(std::size_t& from);

  /// A blank is due here, and something after it. Reports and returns false otherwise.
  bool expect_blank(std::string_view expected);
  /// A name (any word) is due here.
  bool expect_word(std::string_view expected, std::string& out);
  /// Nothing but blanks may follow.
  bool expect_end(std::string_view expected = "the end of the statement");
  /// Reports what stands here where there are as many already as there may be.
  bool has_room(std::size_t count, std::size_t most);
  /// Reports what stands here as a syntax error; always false.
  bool fail(std::string_view expected);
  bool fail_at(std::size_t from, std::size_t to, std::string_view code, std::string message);

 private:
  const LogicalLine* line_;
  Reporter* reporter_;
  std::string_view text_;
  std::size_t position_;
};

}  // namespace rr
