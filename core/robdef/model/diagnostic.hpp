// Findings in the text of service definitions. Layer: robdef. Source: service definitions spec section 5.8.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

namespace rr {

enum class RobdefMode : std::uint8_t {
  strict,  ///< authoring: the language as specified
  compat,  ///< text from a peer: also what the reference accepts, and the paper's syntax; each relaxation warns
};

enum class Severity : std::uint8_t { warning, error };

struct DiagnosticNote {
  std::uint32_t line = 0;
  std::string message;
};

/// One finding. Lines and columns are 1-based, of physical lines; column 0 means "the whole line". A statement that
/// spans several lines is named by its first; its columns may lie on a later one.
struct Diagnostic {
  Severity severity = Severity::error;
  std::string code;               ///< of the spec's list, e.g. "name-reserved"
  std::string message;            ///< what was found and what was expected
  std::string file;               ///< as given by the caller; may be empty
  std::string service;            ///< service name where known
  std::uint32_t line = 0;         ///< the first line of the statement
  std::uint32_t column_line = 0;  ///< the line that the columns belong to; 0 where they are unknown
  std::uint32_t column = 0;
  std::uint32_t end_column = 0;  ///< one past the last character
  std::vector<DiagnosticNote> notes = {};
};

/// "file:line:column: error: message [code]", a note on a line of its own each; without final line end.
std::string format_diagnostic(const Diagnostic& diagnostic);

/// Most errors, and most warnings, that are kept for one definition: hostile text must not fill memory with findings.
inline constexpr std::size_t max_diagnostics = 500;

}  // namespace rr
