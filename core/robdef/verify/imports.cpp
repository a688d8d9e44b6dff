// Imports, aliases, struct constants. Layer: robdef. Source: service definitions spec sections 5.2, 5.5.1, 5.5.2.
#include <unordered_set>

#include "core/robdef/model/constant_value.hpp"
#include "core/robdef/model/cycles.hpp"
#include "core/robdef/model/names.hpp"
#include "core/robdef/verify/scope.hpp"

namespace rr {

namespace {

void verify_import(VerifyScope& scope, const ImportDefinition& import,
                   const std::unordered_map<std::string_view, VerifyScope*>& services) {
  const auto found = services.find(import.name);
  auto* const target = found == services.end() ? nullptr : found->second;
  if (!scope.imports.emplace(import.name, target).second) {
    scope.warning("duplicate-import", import.line, import.name, "found the import of " + quote(import.name) + " again");
    return;
  }
  if (target == nullptr) {
    scope.error("import-missing", import.line, import.name,
                "found the import of " + quote(import.name) + ", but no such definition was given");
    return;
  }
  const auto& own = scope.definition->version;
  const auto& other = target->definition->version;
  if (own.is_unspecified()) return;
  if (other.is_unspecified()) {
    scope.error("import-version", import.line, import.name,
                "found the import of " + quote(import.name) + ", which has no version, expected one of at most " +
                    format_version(own));
  } else if (other > own) {
    scope.error("import-version", import.line, import.name,
                "found the import of " + quote(import.name) + " with version " + format_version(other) +
                    ", expected at most " + format_version(own));
  }
}

void verify_import_cycles(VerifySet& set) {
  std::unordered_map<const VerifyScope*, std::size_t> index;
  for (const auto& scope : set) index.emplace(&scope, index.size());
  Graph graph(set.size());
  std::vector<VerifyScope*> scopes;
  for (auto& scope : set) {
    auto& edges = graph[scopes.size()];
    scopes.push_back(&scope);
    for (const auto& [name, target] : scope.imports) {
      if (target != nullptr) edges.push_back(index.at(target));
    }
  }
  for (const auto& cycle : find_cycles(graph)) {
    const std::unordered_set<std::size_t> members(cycle.begin(), cycle.end());
    const auto next_import = [&](std::size_t node) -> const ImportDefinition* {
      for (const auto& import : scopes[node]->definition->imports) {
        auto* const target = scopes[node]->imports.at(import.name);
        if (target != nullptr && members.contains(index.at(target))) return &import;
      }
      return nullptr;
    };
    auto& first = *scopes[cycle.front()];
    const auto* const import = next_import(cycle.front());
    if (import == nullptr) continue;
    first.error("import-cycle", import->line, import->name,
                "found a cycle of imports: " + quote(import->name) + " leads back to " + quote(first.definition->name));
    for (const auto node : cycle) {
      if (const auto* const edge = next_import(node)) {
        first.reporter.note(edge->line, quote(scopes[node]->definition->name) + " imports " + quote(edge->name));
      }
    }
  }
}

/// The type word of a struct constant: own types and those of imports, no aliases.
bool is_known_entity(const VerifyScope& scope, std::string_view name) {
  const auto target = split_qualified(name);
  if (target.service.empty()) return scope.entities.contains(target.name);
  const auto import = scope.imports.find(target.service);
  return import != scope.imports.end() && (import->second == nullptr || import->second->entities.contains(target.name));
}

/// Constants of one scope: references exist, no cycles.
void verify_struct_constants(VerifyScope& scope, const std::vector<ConstantDefinition>& constants) {
  std::unordered_map<std::string_view, std::size_t> index;
  for (std::size_t i = 0; i < constants.size(); ++i) index.emplace(constants[i].name, i);
  Graph graph(constants.size());
  bool has_edges = false;
  for (std::size_t i = 0; i < constants.size(); ++i) {
    const auto& constant = constants[i];
    if (constant.type.name.empty()) continue;
    if (constant.type.name != "struct" && !is_known_entity(scope, constant.type.name)) {
      scope.warning(
          "type-unknown", constant.line, constant.type.name,
          "the struct constant " + quote(constant.name) + " names the unknown type " + quote(constant.type.name));
    }
    std::vector<ConstantIssue> issues;
    const auto value = read_constant_value(constant.type, constant.value_text, issues);
    const auto* const fields = std::get_if<std::vector<ConstantField>>(&value.data);
    if (fields == nullptr) continue;
    for (const auto& field : *fields) {
      if (is_reserved_name(field.name)) {
        scope.error("name-reserved", constant.line, field.name,
                    "found the reserved field name " + quote(field.name) + ", expected another");
      }
      const auto target = index.find(field.constant);
      if (target == index.end()) {
        scope.error("constant-invalid", constant.line, field.constant,
                    "the struct constant " + quote(constant.name) + " refers to " + quote(field.constant) +
                        ", which is no constant of the same scope",
                    field.name);
        continue;
      }
      graph[i].push_back(target->second);
      has_edges = true;
    }
  }
  if (!has_edges) return;
  for (const auto& cycle : find_cycles(graph)) {
    const auto& first = constants[cycle.front()];
    scope.error("recursion", first.line, first.name, "the struct constant " + quote(first.name) + " refers to itself");
    for (const auto node : cycle) {
      scope.reporter.note(constants[node].line, quote(constants[node].name) + " is part of the cycle");
    }
  }
}

}  // namespace

void verify_imports(VerifySet& set) {
  std::unordered_map<std::string_view, VerifyScope*> services;
  for (auto& scope : set) {
    const auto& name = scope.definition->name;
    if (name.empty() || services.emplace(name, &scope).second) continue;
    scope.error("duplicate-name", scope.definition->line, name,
                "found a second definition named " + quote(name) + ", expected one");
  }
  for (auto& scope : set) {
    for (const auto& import : scope.definition->imports) verify_import(scope, import, services);
  }
  verify_import_cycles(set);
}

void verify_aliases(VerifyScope& scope) {
  for (const auto& item : scope.definition->usings) {
    const auto target = split_qualified(item.qualified_name);
    const auto import = scope.imports.find(target.service);
    if (import == scope.imports.end()) {
      scope.error("alias-invalid", item.line, item.qualified_name,
                  "found " + quote(item.qualified_name) + ", but " + quote(target.service) + " is not imported");
      continue;
    }
    if (import->second == nullptr) continue;
    const auto& other = *import->second;
    if (other.entities.contains(target.name) || other.enums.contains(target.name) || other.others.contains(target.name))
      continue;
    scope.error("alias-invalid", item.line, item.qualified_name,
                "found " + quote(item.qualified_name) + ", but " + quote(target.service) + " has nothing of this name");
  }
}

void verify_constants(VerifyScope& scope) {
  verify_struct_constants(scope, scope.definition->constants);
  for (const auto& entity : scope.definition->entities) verify_struct_constants(scope, entity.constants);
}

}  // namespace rr
