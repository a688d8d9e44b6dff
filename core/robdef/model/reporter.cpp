#include "core/robdef/model/reporter.hpp"

#include <algorithm>
#include <iterator>
#include <utility>

namespace rr {

namespace {
constexpr std::size_t max_notes = 20;
}

void Reporter::error(std::string_view code, const SourceSpan& span, std::string message) {
  add(Severity::error, code, span, std::move(message));
}

void Reporter::warning(std::string_view code, const SourceSpan& span, std::string message) {
  add(Severity::warning, code, span, std::move(message));
}

void Reporter::relaxed(std::string_view code, const SourceSpan& span, std::string message) {
  add(is_compat() ? Severity::warning : Severity::error, code, span, std::move(message));
}

void Reporter::note(std::uint32_t line, std::string message) {
  if (!last_was_kept_ || diagnostics_.back().notes.size() >= max_notes) return;
  diagnostics_.back().notes.push_back({line, std::move(message)});
}

std::vector<Diagnostic> Reporter::take() {
  // Nearly in order, and few: a stable_sort is a hundred times the code.
  for (auto at = diagnostics_.begin(); at != diagnostics_.end(); ++at) {
    const auto is_before = [](const Diagnostic& a, const Diagnostic& b) { return a.line < b.line; };
    std::rotate(std::upper_bound(diagnostics_.begin(), at, *at, is_before), at, std::next(at));
  }
  return std::move(diagnostics_);
}

void Reporter::add(Severity severity, std::string_view code, const SourceSpan& span, std::string message) {
  last_was_kept_ = !is_full(severity);
  if (!last_was_kept_) return;
  if (++count_[index(severity)] > max_diagnostics) {
    code = "too-many";
    message = severity == Severity::error ? "more errors follow that are not shown"
                                          : "more warnings follow that are not shown";
  }
  Diagnostic diagnostic;
  diagnostic.severity = severity;
  diagnostic.code = code;
  diagnostic.message = std::move(message);
  diagnostic.file = file_;
  diagnostic.service = service_;
  diagnostic.line = span.line;
  diagnostic.column_line = span.column_line;
  diagnostic.column = span.column;
  diagnostic.end_column = span.end_column;
  diagnostics_.push_back(std::move(diagnostic));
}

std::string format_diagnostic(const Diagnostic& diagnostic) {
  const auto& name = diagnostic.file.empty() ? diagnostic.service : diagnostic.file;
  std::string out = name.empty() ? "definition" : name;
  out += ':' + std::to_string(diagnostic.column != 0 ? diagnostic.column_line : diagnostic.line);
  if (diagnostic.column != 0) out += ':' + std::to_string(diagnostic.column);
  out += diagnostic.severity == Severity::error ? ": error: " : ": warning: ";
  out += diagnostic.message + " [" + diagnostic.code + ']';
  if (diagnostic.column != 0 && diagnostic.column_line != diagnostic.line) {
    out += "\n  line " + std::to_string(diagnostic.line) + ": the statement begins here";
  }
  for (const auto& note : diagnostic.notes) {
    out += "\n  ";
    if (note.line != 0) out += "line " + std::to_string(note.line) + ": ";
    out += note.message;
  }
  return out;
}

}  // namespace rr
