// The verified definitions that values and objects are checked against. Layer: types.
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "core/robdef/robdef.hpp"

namespace rr {

/// A set of definitions that grows: definitions arrive at connect and, for varobject types, later.
/// Definitions that were added never move or change, so pointers to them hold as long as the registry.
class TypeRegistry {
 public:
  using Definitions = std::vector<std::unique_ptr<ServiceDefinition>>;

  /// Parses, verifies together with what they import, and adds all or none. Texts may come in any order but must bring
  /// every import that is not there yet. A definition that is already there (same name) is skipped.
  /// Errors   service_definition_error, with the first diagnostic; the registry is then unchanged.
  Result<> add(const std::vector<std::string>& texts, RobdefMode mode);

  const ServiceDefinition* find_service(std::string_view name) const;
  /// Qualified names, "com.x.Pose".
  const EntityDefinition* find_entity(std::string_view qualified_name) const;
  const EnumDefinition* find_enum(std::string_view qualified_name) const;
  /// All definitions, imports before importers.
  const Definitions& definitions() const { return definitions_; }
  /// Warnings collected by add().
  const std::vector<Diagnostic>& warnings() const { return warnings_; }

 private:
  /// What is there already and `importers` import, imports of imports included.
  std::vector<const ServiceDefinition*> known_imports(const Definitions& importers) const;

  template <class Definition>
  using Index = std::map<std::string, const Definition*, std::less<>>;

  Definitions definitions_;
  Index<ServiceDefinition> services_;
  Index<EntityDefinition> entities_;
  Index<EnumDefinition> enums_;
  std::vector<Diagnostic> warnings_;
};

}  // namespace rr
