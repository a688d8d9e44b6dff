// Collects diagnostics of one definition. Layer: robdef. Source: service definitions spec section 5.8.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "core/robdef/model/diagnostic.hpp"

namespace rr {

/// A place in the text: the line of the statement, and the exact columns where they are known.
struct SourceSpan {
  std::uint32_t line = 0;
  std::uint32_t column_line = 0;
  std::uint32_t column = 0;
  std::uint32_t end_column = 0;
};

/// Findings beyond `max_diagnostics` of a severity are dropped after one that says so.
class Reporter {
 public:
  Reporter(RobdefMode mode, std::string_view file) : mode_(mode), file_(file) {}

  RobdefMode mode() const { return mode_; }
  bool is_compat() const { return mode_ == RobdefMode::compat; }
  void set_service(std::string_view service) { service_ = service; }

  void error(std::string_view code, const SourceSpan& span, std::string message);
  void warning(std::string_view code, const SourceSpan& span, std::string message);
  /// What strict refuses and compat lets through with a warning.
  void relaxed(std::string_view code, const SourceSpan& span, std::string message);
  /// Adds to the finding that was reported last; nothing where that one was dropped.
  void note(std::uint32_t line, std::string message);

  /// Whether a further finding of this severity would be dropped: saves the work of preparing it.
  bool is_full(Severity severity) const { return count_[index(severity)] > max_diagnostics; }
  /// Hands out everything, stably sorted by line.
  std::vector<Diagnostic> take();

 private:
  static std::size_t index(Severity severity) { return static_cast<std::size_t>(severity); }
  void add(Severity severity, std::string_view code, const SourceSpan& span, std::string message);

  RobdefMode mode_;
  std::string file_;
  std::string service_ = {};
  std::size_t count_[2] = {0, 0};
  bool last_was_kept_ = false;
  std::vector<Diagnostic> diagnostics_ = {};
};

}  // namespace rr
