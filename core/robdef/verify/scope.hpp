// What verification knows about each definition of the set, and its passes. Layer: robdef.
// Source: service definitions spec sections 5.2..5.8.
#pragma once

#include <deque>
#include <string_view>
#include <unordered_map>
#include <vector>

#include "core/robdef/model/reporter.hpp"
#include "core/robdef/model/service_definition.hpp"
#include "core/robdef/parse/source_locator.hpp"

namespace rr {

/// One definition of the set. Borrows it for the verification.
struct VerifyScope {
  VerifyScope(ServiceDefinition& verified, RobdefMode mode)
      : definition(&verified), reporter(mode, verified.file), locator(verified.text) {
    reporter.set_service(verified.name);
  }

  ServiceDefinition* definition;
  Reporter reporter;
  SourceLocator locator;
  std::unordered_map<std::string_view, VerifyScope*> imports = {};      ///< direct ones; nullptr where missing
  std::unordered_map<std::string_view, std::string_view> aliases = {};  ///< alias -> qualified name
  std::unordered_map<std::string_view, EntityDefinition*> entities = {};
  std::unordered_map<std::string_view, EnumDefinition*> enums = {};
  std::unordered_map<std::string_view, std::uint32_t> others = {};  ///< constants and exceptions -> line

  // The columns are looked up only for findings that are kept.
  void error(std::string_view code, std::uint32_t line, std::string_view word, std::string message,
             std::string_view after = {});
  void warning(std::string_view code, std::uint32_t line, std::string_view word, std::string message,
               std::string_view after = {});
  void relaxed(std::string_view code, std::uint32_t line, std::string_view word, std::string message,
               std::string_view after = {});
};

/// A deque: scopes point to each other.
using VerifySet = std::deque<VerifyScope>;

struct ResolvedName {
  DataType type = DataType::void_t;  ///< enum_t, structure_t, pod_t, namedarray_t, object_t; void_t: not found
  VerifyScope* scope = nullptr;
  EntityDefinition* entity = nullptr;
  EnumDefinition* enumeration = nullptr;
  std::string qualified_name = {};
};

/// Looks up a type name as seen from `scope`; reports where it is not found. `line` is that of the statement.
ResolvedName resolve_name(VerifyScope& scope, std::string_view name, std::uint32_t line, std::string_view error_code);

/// Resolves a named type in place. Built-in types are left alone. False: reported.
bool resolve_type(VerifyScope& scope, TypeDefinition& type, std::uint32_t line);

/// Names of one name space: valid, not reserved, unique; warns where names differ by case only.
class NameSpace {
 public:
  NameSpace(VerifyScope& scope, std::string_view place) : scope_(&scope), place_(place) {}
  /// `after` is a word that stands before the name in its statement, to find the column.
  void declare(std::string_view name, std::uint32_t line, std::string_view after = {});

 private:
  VerifyScope* scope_;
  std::string place_;
  std::unordered_map<std::string_view, std::uint32_t> lines_ = {};
  std::unordered_map<std::string, std::string_view> folded_ = {};
};

// The passes, in this order.
void verify_versions(VerifyScope& scope);
void verify_names(VerifyScope& scope);
void verify_imports(VerifySet& set);
void verify_aliases(VerifyScope& scope);
void verify_constants(VerifyScope& scope);
void verify_fields(VerifyScope& scope);
void verify_containment(VerifySet& set);
void verify_members(VerifyScope& scope);
void verify_implements(VerifySet& set);

/// Value types at `place` ("field 'x'"): void, generators, objects and arrays of what has no arrays are refused.
/// Returns false after an error.
bool check_value_type(VerifyScope& scope, const TypeDefinition& type, std::uint32_t line, std::string_view place);

}  // namespace rr
