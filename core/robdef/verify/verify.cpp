// Verification of a set of definitions. Layer: robdef. Source: service definitions spec section 5.7.
#include <deque>
#include <iterator>
#include <utility>

#include "core/robdef/verify/verify.hpp"

#include "core/robdef/verify/scope.hpp"

namespace rr {

namespace {

void collect_names(VerifyScope& scope) {
  auto& definition = *scope.definition;
  for (const auto& item : definition.usings) scope.aliases.emplace(item.alias, item.qualified_name);
  for (auto& item : definition.entities) scope.entities.emplace(item.name, &item);
  for (auto& item : definition.enums) scope.enums.emplace(item.name, &item);
  for (const auto& item : definition.constants) scope.others.emplace(item.name, item.line);
  for (const auto& item : definition.exceptions) scope.others.emplace(item.name, item.line);
}

}  // namespace

std::vector<Diagnostic> verify_service_definitions(std::span<ServiceDefinition* const> definitions, RobdefMode mode) {
  VerifySet set;
  for (auto* definition : definitions) {
    for (auto& entity : definition->entities) entity.qualified_name = definition->name + "." + entity.name;
    set.emplace_back(*definition, mode);
  }
  for (auto& scope : set) collect_names(scope);
  for (auto& scope : set) verify_versions(scope);
  for (auto& scope : set) verify_names(scope);
  verify_imports(set);
  for (auto& scope : set) {
    verify_aliases(scope);
    verify_constants(scope);
    verify_fields(scope);
  }
  verify_containment(set);
  for (auto& scope : set) verify_members(scope);
  verify_implements(set);

  std::vector<Diagnostic> diagnostics;
  for (auto& scope : set) {
    auto found = scope.reporter.take();
    diagnostics.insert(diagnostics.end(), std::make_move_iterator(found.begin()), std::make_move_iterator(found.end()));
  }
  return diagnostics;
}

std::vector<Diagnostic> verify_service_definitions(std::span<ServiceDefinition* const> set,
                                                   std::span<const ServiceDefinition* const> known, RobdefMode mode) {
  std::deque<ServiceDefinition> copies;
  std::vector<ServiceDefinition*> all;
  for (const auto* definition : known) all.push_back(&copies.emplace_back(*definition));
  all.insert(all.end(), set.begin(), set.end());
  return verify_service_definitions(all, mode);
}

}  // namespace rr
