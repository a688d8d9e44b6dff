#include "core/robdef/parse/lexer.hpp"

#include <algorithm>
#include <utility>

#include "core/robdef/model/names.hpp"
#include "core/support/hex.hpp"

namespace rr {

namespace {

constexpr std::string_view byte_order_mark = "\xef\xbb\xbf";

LineKind classify(std::string_view text) {
  const auto start = text.find_first_not_of(" \t");
  if (start == std::string_view::npos) return LineKind::blank;
  if (text[start] != '#') return LineKind::statement;
  return text.substr(start).starts_with("##") ? LineKind::documentation : LineKind::comment;
}

}  // namespace

SourceSpan LogicalLine::span(std::size_t from, std::size_t to) const {
  const auto after = std::upper_bound(segments_.begin(), segments_.end(), from,
                                      [](std::size_t offset, const Segment& item) { return offset < item.offset; });
  const auto& segment = *(after == segments_.begin() ? after : after - 1);
  const auto column = segment.column + static_cast<std::uint32_t>(from - segment.offset);
  // A span that runs into the next physical line is cut at the join.
  if (after != segments_.end()) to = std::min(to, std::max(from, after->offset - 1));
  const auto length = static_cast<std::uint32_t>(std::max(to, from + 1) - from);
  return {line(), segment.line, column, column + length};
}

void LogicalLine::join(const LogicalLine& next) {
  if (!is_joined_) joined_ = source_;
  is_joined_ = true;
  joined_ += ' ';
  for (const auto& segment : next.segments_) {
    segments_.push_back({joined_.size() + segment.offset, segment.line, segment.column});
  }
  joined_ += next.text();
  is_bad_ = is_bad_ || next.is_bad_;
}

void LogicalLine::drop_last() {
  if (is_joined_) {
    joined_.pop_back();
  } else {
    source_.remove_suffix(1);
  }
}

LineReader::LineReader(std::string_view text, Reporter& reporter) : text_(text), reporter_(&reporter) {
  if (!text_.starts_with(byte_order_mark)) return;
  text_.remove_prefix(byte_order_mark.size());
  reporter_->warning("interop", {1, 1, 1, 2}, "the text begins with a byte order mark, which existing peers refuse");
}

const LogicalLine* LineReader::peek() {
  if (!ahead_) ahead_ = read_logical();
  return ahead_ ? &*ahead_ : nullptr;
}

LogicalLine LineReader::take() {
  LogicalLine line = std::move(*ahead_);
  ahead_.reset();
  return line;
}

std::optional<LineReader::PhysicalLine> LineReader::read_physical() {
  if (position_ >= text_.size()) return std::nullopt;
  const auto end = std::min(text_.find('\n', position_), text_.size());
  auto text = text_.substr(position_, end - position_);
  while (text.ends_with('\r')) text.remove_suffix(1);
  position_ = end + 1;
  return PhysicalLine{text, ++number_};
}

std::optional<LogicalLine> LineReader::read_logical() {
  auto physical = read_physical();
  if (!physical) return std::nullopt;
  const auto first = physical->number;
  const auto kind = classify(physical->text);
  bool is_clean = check_characters(*physical, first);
  if (kind == LineKind::documentation) {
    const auto start = physical->text.find('#') + 2;
    return LogicalLine(kind, physical->text.substr(start), first, static_cast<std::uint32_t>(start + 1));
  }
  LogicalLine line(kind, physical->text, first, 1);
  while (kind == LineKind::statement && line.text().ends_with('\\')) {
    line.drop_last();
    physical = read_physical();
    if (!physical) {
      reporter_->error("bad-continuation", line.span(line.text().size(), line.text().size() + 1),
                       "found '\\' at the end of the text, expected a line that continues the statement");
      is_clean = false;
      break;
    }
    is_clean = check_characters(*physical, first) && is_clean;
    line.join(LogicalLine(kind, physical->text, physical->number, 1));
  }
  if (!is_clean && kind == LineKind::statement) line.mark_bad();
  return line;
}

bool LineReader::check_characters(const PhysicalLine& physical, std::uint32_t statement_line) {
  const auto bad = std::find_if_not(physical.text.begin(), physical.text.end(), is_text_character);
  if (bad == physical.text.end()) return true;
  const auto column = static_cast<std::uint32_t>(bad - physical.text.begin()) + 1;
  const auto byte = static_cast<unsigned char>(*bad);
  reporter_->error("bad-character", {statement_line, physical.number, column, column + 1},
                   "found the byte 0x" + hex_text(byte, 2) + ", expected printable ASCII characters and tabs only");
  return false;
}

}  // namespace rr
