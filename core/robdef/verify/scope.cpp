#include "core/robdef/verify/scope.hpp"

#include "core/robdef/model/names.hpp"

namespace rr {

void VerifyScope::error(std::string_view code, std::uint32_t line, std::string_view word, std::string message,
                        std::string_view after) {
  const auto span = reporter.is_full(Severity::error) ? SourceSpan{line, 0, 0, 0} : locator.find(line, word, after);
  reporter.error(code, span, std::move(message));
}

void VerifyScope::warning(std::string_view code, std::uint32_t line, std::string_view word, std::string message,
                          std::string_view after) {
  const auto span = reporter.is_full(Severity::warning) ? SourceSpan{line, 0, 0, 0} : locator.find(line, word, after);
  reporter.warning(code, span, std::move(message));
}

void VerifyScope::relaxed(std::string_view code, std::uint32_t line, std::string_view word, std::string message,
                          std::string_view after) {
  if (reporter.is_compat()) {
    warning(code, line, word, std::move(message), after);
  } else {
    error(code, line, word, std::move(message), after);
  }
}

namespace {

/// The name as seen by those who import the definition, or by itself.
ResolvedName find_in(VerifyScope& target, std::string_view name) {
  ResolvedName out;
  out.scope = &target;
  if (const auto found = target.entities.find(name); found != target.entities.end()) {
    out.entity = found->second;
    switch (found->second->kind) {
      case EntityKind::structure:
        out.type = DataType::structure_t;
        break;
      case EntityKind::pod:
        out.type = DataType::pod_t;
        break;
      case EntityKind::namedarray:
        out.type = DataType::namedarray_t;
        break;
      case EntityKind::object:
        out.type = DataType::object_t;
        break;
    }
  } else if (const auto found_enum = target.enums.find(name); found_enum != target.enums.end()) {
    out.enumeration = found_enum->second;
    out.type = DataType::enum_t;
  }
  if (out.type != DataType::void_t) out.qualified_name = target.definition->name + '.' + std::string(name);
  return out;
}

}  // namespace

ResolvedName resolve_name(VerifyScope& scope, std::string_view name, std::uint32_t line, std::string_view error_code) {
  if (name == "structure") {
    scope.error(error_code, line, name, "found 'structure', a built-in word that is no usable type");
    return {};
  }
  auto target = split_qualified(name);
  bool is_alias = false;
  if (target.service.empty()) {
    if (const auto alias = scope.aliases.find(name); alias != scope.aliases.end()) {
      target = split_qualified(alias->second);
      is_alias = true;
    } else {
      auto found = find_in(scope, name);
      if (found.type == DataType::void_t) {
        scope.error(error_code, line, name,
                    scope.others.contains(name)
                        ? "found " + quote(name) + ", which is no type, expected one"
                        : "found the unknown name " + quote(name) + ", expected a type of this definition or an alias");
      }
      return found;
    }
  } else if (target.service == scope.definition->name) {
    auto found = find_in(scope, target.name);
    const auto message = "found " + quote(name) + ", expected " + quote(target.name);
    if (found.type == DataType::void_t) {
      scope.error(error_code, line, name, message + ", which does not exist either");
    } else {
      scope.relaxed(error_code, line, name, message + ": a definition does not qualify its own types");
    }
    return found;
  }
  const auto import = scope.imports.find(target.service);
  if (import == scope.imports.end()) {
    // A bad alias has been reported where it is declared, a missing import where it is imported.
    if (is_alias) return {};
    scope.error(error_code, line, name,
                "found " + quote(name) + ", but " + quote(target.service) + " is not imported by this definition");
    return {};
  }
  if (import->second == nullptr) return {};
  auto found = find_in(*import->second, target.name);
  const bool is_other = import->second->others.contains(target.name);
  if (found.type == DataType::void_t && (is_other || !is_alias)) {
    scope.error(error_code, line, name,
                "found " + quote(name) + ", but " + quote(target.name) + " is no type of " + quote(target.service));
  }
  return found;
}

bool resolve_type(VerifyScope& scope, TypeDefinition& type, std::uint32_t line) {
  if (type.name.empty()) return true;
  auto found = resolve_name(scope, type.name, line, "type-unknown");
  type.type = found.type == DataType::void_t ? DataType::namedtype_t : found.type;
  type.qualified_name = std::move(found.qualified_name);
  return type.type != DataType::namedtype_t;
}

}  // namespace rr
