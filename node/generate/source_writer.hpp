// Generated source text: lines, indented blocks, documentation. Layer: definitions.
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace rrgate {

/// The lines of `##` documentation without the customary blank behind the signs, without empty lines at either end.
std::vector<std::string> documentation_lines(std::string_view documentation);

/// "a, b, c".
std::string joined(const std::vector<std::string>& parts, std::string_view separator = ", ");

/// How a language writes documentation: "/** text */", or "/// text" on each line.
enum class DocStyle { block, lines };

class SourceWriter {
 public:
  explicit SourceWriter(DocStyle style) : style_(style) {}

  void line(std::string_view text);
  /// One empty line; none behind an opening or another empty line.
  void gap();
  /// Writes `text` and indents what follows, until close().
  void open(std::string_view text);
  void close(std::string_view text = "}");
  /// Unindented: labels such as "public:".
  void label(std::string_view text);
  void documentation(std::string_view text, std::string_view more = {});

  /// All that was written, without empty lines at the end.
  std::string take();

 private:
  DocStyle style_;
  std::size_t depth_ = 0;
  bool is_fresh_ = true;  ///< an empty line would be one too many
  std::string text_ = {};
};

}  // namespace rrgate
