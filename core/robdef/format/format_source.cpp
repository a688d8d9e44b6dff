#include "core/robdef/format/format_source.hpp"

#include <unordered_map>
#include <vector>

#include "core/robdef/format/statement_text.hpp"
#include "core/robdef/model/names.hpp"
#include "core/robdef/parse/lexer.hpp"
#include "core/robdef/parse/parse.hpp"
#include "core/support/words.hpp"

namespace rr {

namespace {

constexpr std::size_t max_columns = 79;
constexpr std::string_view step = "    ";

/// Breaks `line` at blanks behind which further blanks mean nothing: those before the modifiers, whose text is kept.
std::string wrap_member(std::string line, std::string_view indent) {
  const auto next_indent = std::string(indent) + std::string(step);
  std::string out;
  while (line.size() > max_columns) {
    const auto last = std::min(max_columns - 1, line.find(" ["));  // the backslash needs a column
    const auto first = line.find_first_not_of(' ');
    const auto blank = line.rfind(' ', last);
    if (blank == std::string::npos || blank < first) break;
    out += line.substr(0, blank) + " \\\n";
    line = next_indent + line.substr(blank + 1);
  }
  return out + line;
}

class SourceFormatter {
 public:
  explicit SourceFormatter(const ServiceDefinition& definition) : definition_(definition) { index(); }

  std::string format();

 private:
  void index();
  void add(std::uint32_t line, std::string text) { statements_[line].push_back(std::move(text)); }
  void write_statement(const LogicalLine& line);
  void write_line(std::string_view text);

  const ServiceDefinition& definition_;
  std::unordered_map<std::uint32_t, std::vector<std::string>> statements_ = {};  ///< by the line of their source
  bool is_in_block_ = false;
  bool is_blank_due_ = false;
  std::string out_ = {};
};

void SourceFormatter::index() {
  add(definition_.line, "service " + definition_.name);
  if (!definition_.version_is_option && definition_.version_line != 0)
    add(definition_.version_line, "stdver " + format_version(definition_.version));
  for (const auto& item : definition_.imports) add(item.line, "import " + item.name);
  for (const auto& item : definition_.usings) add(item.line, using_text(item));
  for (const auto& item : definition_.options) add(item.line, "option " + item.text);
  for (const auto& item : definition_.constants) add(item.line, constant_text(item));
  for (const auto& item : definition_.exceptions) add(item.line, "exception " + item.name);
  for (const auto& item : definition_.enums) {
    add(item.line, "enum " + item.name);
    for (const auto& value : item.values)
      add(value.line, std::string(step) + enum_value_text(value) + (&value == &item.values.back() ? "" : ","));
  }
  for (const auto& item : definition_.entities) {
    add(item.line, entity_header_text(item));
    for (const auto& base : item.implements) add(base.line, std::string(step) + "implements " + base.name);
    for (const auto& option : item.options) add(option.line, std::string(step) + "option " + option.text);
    for (const auto& constant : item.constants) add(constant.line, std::string(step) + constant_text(constant));
    for (const auto& member : item.members)
      add(member.line, wrap_member(std::string(step) + member_text(member, nullptr), step));
  }
}

std::string SourceFormatter::format() {
  Reporter reporter(RobdefMode::strict, {});  // there is nothing new to report
  LineReader lines(definition_.text, reporter);
  while (lines.peek()) {
    const auto line = lines.take();
    const std::string indent(is_in_block_ ? step : "");
    switch (line.kind()) {
      case LineKind::blank:
        is_blank_due_ = !out_.empty();
        break;
      case LineKind::documentation:
        write_line(indent + "##" + std::string(line.text()));
        break;
      case LineKind::comment:
        write_line(indent + std::string(trim(line.text())));
        break;
      case LineKind::statement:
        write_statement(line);
        break;
    }
  }
  return std::move(out_);
}

void SourceFormatter::write_statement(const LogicalLine& line) {
  const auto word = split_words(line.text()).front();
  if (is_in_block_ && word == "end") {
    is_in_block_ = false;
    write_line("end");
    return;
  }
  for (const auto& text : statements_[line.line()]) write_line(text);
  is_in_block_ =
      is_in_block_ || word == "enum" || word == "struct" || word == "pod" || word == "namedarray" || word == "object";
}

void SourceFormatter::write_line(std::string_view text) {
  if (is_blank_due_) out_ += '\n';
  is_blank_due_ = false;
  const auto end = text.find_last_not_of(" \t");
  out_ += std::string(text.substr(0, end + 1)) + '\n';
}

}  // namespace

std::string format_source(const ServiceDefinition& definition) {
  return SourceFormatter(definition).format();
}

}  // namespace rr
