// Versions, feature gates, names and name spaces. Layer: robdef. Source: service definitions spec
// sections 5.1, 5.2, 5.6.
#include <algorithm>

#include "core/robdef/model/constant_value.hpp"
#include "core/robdef/model/names.hpp"
#include "core/robdef/model/version_levels.hpp"
#include "core/robdef/parse/statement.hpp"
#include "core/robdef/verify/scope.hpp"

namespace rr {

namespace {

struct FeatureUse {
  std::string_view feature;
  std::uint32_t line = 0;

  void add(std::uint32_t other) { line = line == 0 ? other : std::min(line, other); }
};

void verify_service_name(VerifyScope& scope) {
  const auto& definition = *scope.definition;
  const std::string_view name = definition.name;
  if (name.starts_with("RobotRaconteurTestService") || name == "RobotRaconteurServiceIndex") return;
  if (!is_qualified_name(name)) {
    scope.error("name-invalid", definition.line, name,
                "found the service name " + quote(name) + ", expected names joined by dots");
  } else if (is_reserved_name(name) || name.ends_with("_signed")) {
    scope.error("name-reserved", definition.line, name,
                "found the reserved service name " + quote(name) + ", expected another");
  }
}

struct TopLevelName {
  std::string_view name;
  std::uint32_t line;
  std::string_view after;
};

void verify_top_level_names(VerifyScope& scope) {
  const auto& definition = *scope.definition;
  const auto old_constants = option_constants(definition.options);
  std::vector<TopLevelName> names;
  for (const auto& item : definition.usings) names.push_back({item.alias, item.line, {}});
  for (const auto& item : old_constants) names.push_back({item.name, item.line, {}});
  for (const auto& item : definition.constants) names.push_back({item.name, item.line, {}});
  for (const auto& item : definition.exceptions) names.push_back({item.name, item.line, "exception"});
  for (const auto& item : definition.enums) names.push_back({item.name, item.line, "enum"});
  for (const auto& item : definition.entities) names.push_back({item.name, item.line, {}});
  std::stable_sort(names.begin(), names.end(),
                   [](const TopLevelName& a, const TopLevelName& b) { return a.line < b.line; });
  NameSpace name_space(scope, "this definition");
  for (const auto& item : names) name_space.declare(item.name, item.line, item.after);
  for (const auto& item : definition.enums) {
    if (item.name == "structure") {
      scope.warning("interop", item.line, item.name, "an enum named 'structure' can never be used as a type");
    }
  }
  for (const auto& item : definition.entities) {
    if (item.name == "structure") {
      scope.warning("interop", item.line, item.name, "a type named 'structure' can never be used");
    }
  }
}

void verify_enum_values(VerifyScope& scope, const EnumDefinition& enumeration) {
  if (enumeration.values.empty()) {
    scope.warning("empty-enum", enumeration.line, enumeration.name,
                  "the enum " + quote(enumeration.name) + " has no values");
  }
  NameSpace names(scope, "the enum " + quote(enumeration.name));
  std::unordered_map<std::int32_t, const EnumValueDefinition*> numbers;
  for (const auto& value : enumeration.values) {
    names.declare(value.name, value.line);
    const auto [first, is_new] = numbers.emplace(value.value, &value);
    if (is_new) continue;
    scope.error("enum-invalid", value.line, value.name,
                "found the value " + std::to_string(value.value) + " for " + quote(value.name) + ", but " +
                    quote(first->second->name) + " has it already");
    scope.reporter.note(first->second->line, quote(first->second->name) + " is declared here");
  }
}

void verify_entity_names(VerifyScope& scope, const EntityDefinition& entity) {
  const auto old_constants = option_constants(entity.options);
  std::vector<TopLevelName> names;
  for (const auto& item : old_constants) names.push_back({item.name, item.line, {}});
  for (const auto& item : entity.constants) names.push_back({item.name, item.line, {}});
  for (const auto& item : entity.members) names.push_back({item.name, item.line, {}});
  std::stable_sort(names.begin(), names.end(),
                   [](const TopLevelName& a, const TopLevelName& b) { return a.line < b.line; });
  NameSpace name_space(scope, quote(entity.name));
  for (const auto& item : names) name_space.declare(item.name, item.line, item.after);
}

}  // namespace

void NameSpace::declare(std::string_view name, std::uint32_t line, std::string_view after) {
  if (!is_name(name)) {
    scope_->error("name-invalid", line, name,
                  "found the name " + quote(name) + ", expected a letter, then letters, digits and inner '_'", after);
    return;
  }
  if (is_reserved_name(name)) {
    scope_->error("name-reserved", line, name, "found the reserved name " + quote(name) + ", expected another", after);
  }
  const auto [first, is_new] = lines_.emplace(name, line);
  if (!is_new) {
    scope_->error("duplicate-name", line, name,
                  "found the name " + quote(name) + " again in " + place_ + ", expected it once", after);
    scope_->reporter.note(first->second, quote(name) + " is first declared here");
    return;
  }
  const auto [same, is_alone] = folded_.emplace(to_lower(name), name);
  if (is_alone) return;
  scope_->warning("case-clash", line, name,
                  "the names " + quote(same->second) + " and " + quote(name) + " in " + place_ + " differ by case only",
                  after);
}

void verify_versions(VerifyScope& scope) {
  const auto& definition = *scope.definition;
  if (definition.version > newest_known) {
    scope.error(
        "version-too-new", definition.version_line, {},
        "found version " + format_version(definition.version) + ", expected at most " + format_version(newest_known));
  }
  if (!definition.version_is_option || definition.version >= first_stdver) return;
  FeatureUse constants{"constant"};
  FeatureUse usings{"using"};
  FeatureUse enums{"enum"};
  FeatureUse modifiers{"member modifiers"};
  for (const auto& item : definition.constants) constants.add(item.line);
  for (const auto& item : definition.usings) usings.add(item.line);
  for (const auto& item : definition.enums) enums.add(item.line);
  for (const auto& entity : definition.entities) {
    if (entity.kind == EntityKind::object) {
      for (const auto& item : entity.constants) constants.add(item.line);
    }
    for (const auto& item : entity.members) {
      if (!item.modifiers.empty()) modifiers.add(item.line);
    }
  }
  for (const auto& use : {constants, usings, enums, modifiers}) {
    if (use.line == 0) continue;
    scope.relaxed("version-gate", use.line, {},
                  "found " + std::string(use.feature) + " under version " + format_version(definition.version) +
                      ", expected version 0.9 or more for it");
  }
}

void verify_names(VerifyScope& scope) {
  verify_service_name(scope);
  verify_top_level_names(scope);
  for (const auto& enumeration : scope.definition->enums) verify_enum_values(scope, enumeration);
  for (const auto& entity : scope.definition->entities) verify_entity_names(scope, entity);
}

}  // namespace rr
