#include "core/robdef/parse/source_locator.hpp"

#include <algorithm>

#include "core/robdef/model/names.hpp"

namespace rr {

namespace {

/// Statements go on for a few lines at most; hostile ones are not worth the search.
constexpr std::uint32_t max_lines = 50;
constexpr std::size_t max_line_length = 4096;

std::size_t find_word(std::string_view text, std::string_view word, std::size_t from) {
  const auto is_part = [](char c) { return is_word_character(c) || c == '.'; };
  while (true) {
    const auto found = text.find(word, from);
    if (found == std::string_view::npos) return found;
    const auto end = found + word.size();
    const bool is_whole = (found == 0 || !is_part(text[found - 1])) && (end == text.size() || !is_part(text[end]));
    if (is_whole) return found;
    from = found + 1;
  }
}

}  // namespace

SourceSpan SourceLocator::find(std::uint32_t line, std::string_view word, std::string_view after) {
  const SourceSpan unknown{line, 0, 0, 0};
  if (line == 0 || text_.empty() || word.empty()) return unknown;
  bool is_after = after.empty();
  for (auto number = line; number < line + max_lines; ++number) {
    const auto text = line_text(number);
    std::size_t from = 0;
    if (!is_after) {
      const auto found = find_word(text, after, 0);
      is_after = found != std::string_view::npos;
      if (is_after) from = found + after.size();
    }
    const auto found = is_after ? find_word(text, word, from) : std::string_view::npos;
    if (found != std::string_view::npos) {
      const auto column = static_cast<std::uint32_t>(found + 1);
      return {line, number, column, column + static_cast<std::uint32_t>(word.size())};
    }
    const bool may_go_on = text.ends_with('\\') || text.find('(') != std::string_view::npos;
    if (!may_go_on) break;
  }
  return unknown;
}

std::string_view SourceLocator::line_text(std::uint32_t line) {
  if (line_starts_.empty()) {
    if (text_.starts_with("\xef\xbb\xbf")) text_.remove_prefix(3);
    line_starts_.push_back(0);
    for (auto end = text_.find('\n'); end != std::string_view::npos; end = text_.find('\n', end + 1)) {
      line_starts_.push_back(end + 1);
    }
  }
  if (line > line_starts_.size()) return {};
  const auto start = line_starts_[line - 1];
  const auto end = line < line_starts_.size() ? line_starts_[line] - 1 : text_.size();
  auto text = text_.substr(start, end - start);
  while (text.ends_with('\r')) text.remove_suffix(1);
  return text.substr(0, max_line_length);
}

}  // namespace rr
