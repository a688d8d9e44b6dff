// Physical lines -> logical lines: continuation, comments, documentation, characters. Layer: robdef.
// Source: service definitions spec section 5.1.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/robdef/model/reporter.hpp"

namespace rr {

enum class LineKind : std::uint8_t { statement, documentation, comment, blank };

/// One logical line; the text is borrowed from the source unless lines were joined.
class LogicalLine {
 public:
  LogicalLine(LineKind kind, std::string_view text, std::uint32_t line, std::uint32_t column)
      : kind_(kind), source_(text), segments_{{0, line, column}} {}

  LineKind kind() const { return kind_; }
  /// Of documentation: what follows the two signs.
  std::string_view text() const { return is_joined_ ? std::string_view(joined_) : source_; }
  std::uint32_t line() const { return segments_.front().line; }
  /// Where text()[from, to) stands in the source.
  SourceSpan span(std::size_t from, std::size_t to) const;
  /// Holds an illegal character or an impossible continuation, already reported: not to be parsed.
  bool is_bad() const { return is_bad_; }
  void mark_bad() { is_bad_ = true; }

  /// Appends a space and the other line.
  void join(const LogicalLine& next);
  /// Drops the last character (the backslash of a continuation).
  void drop_last();

 private:
  struct Segment {
    std::size_t offset;
    std::uint32_t line;
    std::uint32_t column;
  };

  LineKind kind_;
  bool is_bad_ = false;
  bool is_joined_ = false;
  std::string_view source_;
  std::string joined_ = {};
  std::vector<Segment> segments_;
};

/// Reads logical lines one after another, with one line of lookahead. `text` and `reporter` are borrowed for life.
class LineReader {
 public:
  LineReader(std::string_view text, Reporter& reporter);

  /// The next line without taking it; nullptr at the end. Valid until the next call.
  const LogicalLine* peek();
  /// Only after peek() found a line.
  LogicalLine take();

 private:
  struct PhysicalLine {
    std::string_view text;
    std::uint32_t number;
  };

  std::optional<PhysicalLine> read_physical();
  std::optional<LogicalLine> read_logical();
  bool check_characters(const PhysicalLine& physical, std::uint32_t statement_line);

  std::string_view text_;
  Reporter* reporter_;
  std::size_t position_ = 0;
  std::uint32_t number_ = 0;
  std::optional<LogicalLine> ahead_ = {};
};

}  // namespace rr
