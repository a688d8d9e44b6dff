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

/// One finding. Lines and columns are 1-based, of physical lines; column 0 means "the whole line".
struct Diagnostic {
  Severity severity = Severity::error;
  std::string code;     ///< of the spec's list, e.g. "name-reserved"
  std::string message;  ///< what was found and what was expected
  std::string file;     ///< as given by the caller; may be empty
  std::string service;  ///< service name where known
  std::uint32_t line = 0;
  std::uint32_t column = 0;
  std::uint32_t end_column = 0;
  std::vector<DiagnosticNote> notes = {};
};

/// "file:line:column: error: message [code]".
std::string format_diagnostic(const Diagnostic& diagnostic);

struct ParseResult {
  ServiceDefinition definition;  ///< usable where no diagnostic is an error
  std::vector<Diagnostic> diagnostics;
  bool ok() const;
};

/// Parses one definition; reports all errors, not only the first. Types are not resolved yet: verify() does that.
ParseResult parse_service_definition(std::string_view text, RobdefMode mode, std::string_view file = {});

/// Verifies a set that holds all imports transitively and fills in resolved types (TypeDefinition::type and
/// qualified_name, ImplementsDefinition::qualified_name, namedarray_type/_count).
/// Returns  every finding; the set is usable where none is an error.
std::vector<Diagnostic> verify_service_definitions(std::span<ServiceDefinition* const> set, RobdefMode mode);

/// The canonical text (spec section 5.9).
std::string format_service_definition(const ServiceDefinition& definition);

/// Equality of spec section 5.9 (documentation does not count).
bool is_equal(const ServiceDefinition& left, const ServiceDefinition& right);

}  // namespace rr
