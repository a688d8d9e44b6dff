// Text of service definitions -> verified ServiceDefinition, and back. Layer: robdef.
// Source: service definitions spec.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "core/robdef/service_definition.hpp"

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

struct ParseResult {
  ServiceDefinition definition;  ///< usable where no diagnostic is an error
  std::vector<Diagnostic> diagnostics;
  bool ok() const;
};

/// Most errors, and most warnings, that are kept for one definition: hostile text must not fill memory with findings.
inline constexpr std::size_t max_diagnostics = 500;

/// Parses one definition; reports all errors, not only the first. Types are not resolved yet: verify() does that.
/// Time and memory are linear in the length of the text, whatever it holds.
ParseResult parse_service_definition(std::string_view text, RobdefMode mode, std::string_view file = {});

/// Verifies a set that holds all imports transitively and fills in resolved types (TypeDefinition::type and
/// qualified_name, ImplementsDefinition::qualified_name, namedarray_type/_count).
/// Definitions that were verified before may be in the set again.
/// Returns  every finding, by definition and line; the set is usable where none is an error.
std::vector<Diagnostic> verify_service_definitions(std::span<ServiceDefinition* const> set, RobdefMode mode);

/// The canonical text (spec section 5.9).
std::string format_service_definition(const ServiceDefinition& definition);

/// Equality of spec section 5.9 (documentation does not count).
bool is_equal(const ServiceDefinition& left, const ServiceDefinition& right);

}  // namespace rr
