// Finds words in the source text, for the columns of verification errors. Layer: robdef.
#pragma once

#include <string_view>
#include <vector>

#include "core/robdef/model/reporter.hpp"

namespace rr {

/// `text` is borrowed for life.
class SourceLocator {
 public:
  explicit SourceLocator(std::string_view text) : text_(text) {}

  /// Where the whole word `word` stands in the statement that begins at `line`, if need be after the whole word
  /// `after`. Without columns where it is not found.
  SourceSpan find(std::uint32_t line, std::string_view word, std::string_view after = {});

 private:
  std::string_view line_text(std::uint32_t line);

  std::string_view text_;
  std::vector<std::size_t> line_starts_ = {};
};

}  // namespace rr
