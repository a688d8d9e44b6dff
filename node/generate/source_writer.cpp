#include "node/generate/source_writer.hpp"

#include <utility>

namespace rrgate {

std::vector<std::string> documentation_lines(std::string_view documentation) {
  std::vector<std::string> lines;
  for (std::size_t at = 0; at <= documentation.size();) {
    const auto end = std::min(documentation.find('\n', at), documentation.size());
    auto line = documentation.substr(at, end - at);
    if (line.starts_with(' ')) line.remove_prefix(1);
    const auto last = line.find_last_not_of(" \t");
    lines.emplace_back(line.substr(0, last + 1));
    at = end + 1;
  }
  while (!lines.empty() && lines.back().empty()) lines.pop_back();
  while (!lines.empty() && lines.front().empty()) lines.erase(lines.begin());
  return lines;
}

std::string joined(const std::vector<std::string>& parts, std::string_view separator) {
  std::string out;
  for (const auto& part : parts) {
    if (&part != &parts.front()) out += separator;
    out += part;
  }
  return out;
}

void SourceWriter::line(std::string_view text) {
  if (!text.empty()) text_ += std::string(depth_ * 2, ' ') + std::string(text);
  text_ += '\n';
  is_fresh_ = false;
}

void SourceWriter::gap() {
  if (is_fresh_) return;
  text_ += '\n';
  is_fresh_ = true;
}

void SourceWriter::open(std::string_view text) {
  line(text);
  ++depth_;
  is_fresh_ = true;
}

void SourceWriter::close(std::string_view text) {
  if (text_.ends_with("\n\n")) text_.pop_back();
  --depth_;
  line(text);
}

void SourceWriter::label(std::string_view text) {
  text_ += std::string(depth_ * 2 - 1, ' ') + std::string(text) + '\n';
  is_fresh_ = true;
}

void SourceWriter::documentation(std::string_view text, std::string_view more) {
  auto lines = documentation_lines(text);
  if (!more.empty()) lines.emplace_back(more);
  if (lines.empty()) return;
  if (style_ == DocStyle::lines) {
    // A backslash at the end would take the next line into the comment.
    for (const auto& text_line : lines)
      line(text_line.empty() ? "///" : "/// " + text_line + (text_line.ends_with('\\') ? " ." : ""));
    return;
  }
  for (auto& text_line : lines)
    for (auto end = text_line.find("*/"); end != std::string::npos; end = text_line.find("*/", end + 2))
      text_line.replace(end, 2, "*\\/");
  if (lines.size() == 1) {
    line("/** " + lines.front() + " */");
    return;
  }
  line("/**");
  for (const auto& text_line : lines) line(text_line.empty() ? " *" : " * " + text_line);
  line(" */");
}

std::string SourceWriter::take() {
  while (text_.ends_with("\n\n")) text_.pop_back();
  is_fresh_ = true;
  return std::exchange(text_, {});
}

}  // namespace rrgate
