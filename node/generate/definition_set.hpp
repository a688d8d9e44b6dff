// Service definitions from files, with everything that they import. Layer: definitions (tools on the terminal).
// Source: service definitions spec sections 5.7, 5.8.
#pragma once

#include <deque>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "core/robdef/robdef.hpp"

namespace rrgate {

/// The definition of a file. Standard input ("-") may have several, one behind the other as `rrgate robdef` prints
/// them; lines of diagnostics are those of all of it. Nothing where there is no file that can be read.
std::optional<std::vector<rr::ParseResult>> parse_definitions(const std::string& file, rr::RobdefMode mode);

/// A set of definitions, parsed and verified together. Definitions never move.
class DefinitionSet {
 public:
  /// Reads `files`, of which "-" is standard input; what they import is taken from among them, else from NAME.robdef
  /// beside the file that imports it, else from NAME.robdef in one of `folders`.
  static DefinitionSet from_files(std::span<const std::string> files, std::span<const std::string> folders,
                                  rr::RobdefMode mode);
  /// The texts must bring every import.
  static DefinitionSet from_texts(std::span<const std::string> texts, rr::RobdefMode mode);

  /// Everything that was found: of files that can't be read, of the texts, of the set as a whole.
  const std::vector<rr::Diagnostic>& diagnostics() const { return diagnostics_; }
  /// No diagnostic is an error: types are resolved.
  bool is_good() const;

  /// The definitions that were asked for, as given; those found by their imports are not among them.
  std::span<const rr::ServiceDefinition* const> requested() const { return requested_; }
  /// `definition` behind all that it imports, imports before importers. Of a good set.
  std::vector<const rr::ServiceDefinition*> with_imports(const rr::ServiceDefinition& definition) const;
  /// All definitions, imports before importers. Of a good set.
  std::vector<const rr::ServiceDefinition*> in_order() const;
  /// Whether `definition` and all that it imports are as authors write them today. Of a good set.
  bool is_strict(const rr::ServiceDefinition& definition) const;

  /// Nullptr where there is none.
  const rr::ServiceDefinition* find_service(std::string_view name) const;
  const rr::EntityDefinition* find_entity(std::string_view qualified_name) const;
  /// Whether a service is called `name`, or `name` and a dot and more.
  bool has_service_within(std::string_view name) const;

 private:
  class ImportsFirst;

  explicit DefinitionSet(rr::RobdefMode mode) : mode_(mode) {}
  const rr::ServiceDefinition* add(rr::ParseResult parsed);
  bool add_file(const std::string& file);
  void add_imports(std::span<const std::string> folders);
  void verify();

  rr::RobdefMode mode_;
  std::deque<rr::ServiceDefinition> definitions_ = {};
  std::vector<const rr::ServiceDefinition*> requested_ = {};
  std::vector<rr::Diagnostic> diagnostics_ = {};
};

}  // namespace rrgate
