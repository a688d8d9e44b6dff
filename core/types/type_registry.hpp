// The verified definitions that values and objects are checked against. Layer: types.
#pragma once

#include <map>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "core/robdef/robdef.hpp"

namespace rr {

/// A set of definitions that grows: definitions arrive at connect and, for varobject types, later.
/// Definitions that were added never move or change, so pointers to them hold as long as the registry. A copy has the
/// same ones.
class TypeRegistry {
 public:
  using Definitions = std::vector<std::shared_ptr<const ServiceDefinition>>;

  /// Parses, verifies together with what they import, and adds all or none. Texts may come in any order but must bring
  /// every import that is not there yet. A definition that is already there (same name) is skipped.
  /// Errors   service_definition_error, with the first diagnostic; the registry is then unchanged.
  Result<> add(const std::vector<std::string>& texts, RobdefMode mode);
  /// The same with texts that were parsed in this mode.
  Result<> add_parsed(std::vector<ParseResult> parsed, RobdefMode mode);
  /// Adds the definitions of another registry, but for those of names that are there already: their texts must be the
  /// same. Both have the added ones from then on.
  void share(const TypeRegistry& from);

  const ServiceDefinition* find_service(std::string_view name) const;
  /// Qualified names, "com.x.Pose".
  const EntityDefinition* find_entity(std::string_view qualified_name) const;
  const EnumDefinition* find_enum(std::string_view qualified_name) const;
  /// All definitions, imports before importers.
  const Definitions& definitions() const { return definitions_; }

 private:
  /// What is there already and `importers` import, imports of imports included.
  std::vector<const ServiceDefinition*> known_imports(const Definitions& importers) const;
  void insert(std::shared_ptr<const ServiceDefinition> definition);

  template <class Definition>
  using Index = std::map<std::string_view, const Definition*>;  ///< by names that stand in the definitions

  Definitions definitions_;
  Index<ServiceDefinition> services_;
  Index<EntityDefinition> entities_;
};

}  // namespace rr
