// The members of objects: types, parameters, generators, modifiers. Layer: robdef.
// Source: service definitions spec sections 5.4, 5.5.5, 5.5.6.
#include <algorithm>
#include <unordered_set>

#include "core/robdef/model/names.hpp"
#include "core/robdef/verify/scope.hpp"
#include "core/support/words.hpp"

namespace rr {

namespace {

struct ModifierRule {
  std::string_view name;
  std::string_view members;  ///< the first letters are not unique: whole keywords, blank separated
};

constexpr ModifierRule modifier_rules[] = {
    {"readonly", "property field pipe wire memory"},
    {"writeonly", "property field pipe wire memory"},
    {"unreliable", "pipe"},
    {"nolock", "property field function pipe wire memory"},
    {"nolockread", "property field memory"},
    {"perclient", "property field"},
    {"urgent", "property field function event callback"},
};

bool is_known_modifier(const MemberDefinition& member, const Modifier& modifier) {
  if (!modifier.arguments.empty()) return false;
  for (const auto& rule : modifier_rules) {
    if (rule.name != modifier.name) continue;
    const auto members = split_words(rule.members);
    return std::find(members.begin(), members.end(), member_kind_name(member.kind)) != members.end();
  }
  return false;
}

using ConstantNames = std::unordered_set<std::string_view>;

void verify_modifiers(VerifyScope& scope, const MemberDefinition& member, const ConstantNames& constants) {
  const auto place = std::string(member_kind_name(member.kind)) + ' ' + quote(member.name) + ": ";
  std::unordered_set<std::string_view> names;
  for (const auto& modifier : member.modifiers) {
    const auto warn = [&](std::string_view code, std::string_view word, std::string message) {
      scope.warning(code, member.line, word, place + message, member.name);
    };
    if (!is_known_modifier(member, modifier)) {
      warn("unknown-modifier", modifier.name, "the modifier " + quote(modifier.text) + " has no meaning here");
    }
    if (!names.insert(modifier.name).second) {
      warn("modifier-combination", modifier.name, "the modifier " + quote(modifier.name) + " is repeated");
    }
    for (const auto& argument : modifier.arguments) {
      if (!is_name(argument) || constants.contains(argument)) continue;
      warn("modifier-argument", argument, "the argument " + quote(argument) + " is no constant of the object");
    }
  }
  for (const auto& [winner, loser] : {std::pair("readonly", "writeonly"), std::pair("nolock", "nolockread")}) {
    if (!names.contains(winner) || !names.contains(loser)) continue;
    scope.warning("modifier-combination", member.line, loser,
                  place + "found both " + quote(winner) + " and " + quote(loser) + "; " + quote(winner) + " wins",
                  member.name);
  }
}

bool is_generator_type(const TypeDefinition& type) {
  return type.container == ContainerKind::generator;
}

TypeDefinition element_of_generator(TypeDefinition type) {
  type.container = ContainerKind::none;
  return type;
}

/// A parameter or return type, which may be a generator where `may_generate`.
void check_call_type(VerifyScope& scope, const TypeDefinition& type, bool may_generate, std::uint32_t line,
                     std::string_view place) {
  if (!is_generator_type(type) || !may_generate) {
    check_value_type(scope, type, line, place);
  } else if (type.type == DataType::void_t) {
    scope.error("generator", line, "void", std::string(place) + ": found a generator of void, expected a value type");
  } else {
    check_value_type(scope, element_of_generator(type), line, place);
  }
}

void verify_parameter_names(VerifyScope& scope, const MemberDefinition& member, std::string_view place) {
  std::unordered_set<std::string_view> names;
  for (const auto& parameter : member.parameters) {
    const auto where = std::string(place) + ", parameter " + quote(parameter.name) + ": ";
    if (is_reserved_name(parameter.name)) {
      scope.warning("reserved-parameter", member.line, parameter.name, where + "the name is reserved", member.name);
    }
    if (names.insert(parameter.name).second) continue;
    // The reference leaves the generator out of its check.
    const bool is_generator = &parameter == member.step_parameter();
    const auto message = where + "the name is repeated, expected unique names";
    if (is_generator) {
      scope.relaxed("duplicate-name", member.line, parameter.name, message, member.name);
    } else {
      scope.error("duplicate-name", member.line, parameter.name, message, member.name);
    }
  }
}

void verify_call(VerifyScope& scope, MemberDefinition& member) {
  const auto place = std::string(member_kind_name(member.kind)) + ' ' + quote(member.name);
  const bool may_generate = member.kind == MemberKind::function;
  const bool has_generator = may_generate && member.step_parameter();
  verify_parameter_names(scope, member, place);
  for (auto& parameter : member.parameters) {
    if (!resolve_type(scope, parameter.type, member.line)) continue;
    const bool is_last = &parameter == &member.parameters.back();
    const auto where = place + ", parameter " + quote(parameter.name);
    if (may_generate && !is_last && is_generator_type(parameter.type)) {
      scope.error("generator", member.line, parameter.name,
                  where + ": found a generator, expected it as the last parameter only", member.name);
      continue;
    }
    check_call_type(scope, parameter.type, may_generate, member.line, where);
  }
  if (member.kind == MemberKind::event || !resolve_type(scope, member.type, member.line)) return;
  const auto& type = member.type;
  const auto where = place + ", return type";
  if (type.type == DataType::void_t && !is_generator_type(type)) {
    if (type.array == ArrayKind::none && type.container == ContainerKind::none) return;
    const auto message = where + ": found " + quote(format_type(type)) + ", expected void alone";
    if (has_generator) {
      scope.relaxed("type-not-allowed", member.line, "void", message);
    } else {
      scope.error("type-not-allowed", member.line, "void", message);
    }
  } else if (has_generator && !is_generator_type(type)) {
    scope.error(
        "generator", member.line, {},
        where + ": found " + quote(format_type(type)) + " beside a generator parameter, expected void or a generator");
  } else {
    check_call_type(scope, type, may_generate, member.line, where);
  }
}

void verify_memory(VerifyScope& scope, MemberDefinition& member) {
  if (!resolve_type(scope, member.type, member.line)) return;
  const auto& type = member.type;
  const auto found = "memory " + quote(member.name) + ": found the type " + quote(format_type(type)) + ", expected ";
  const auto word = type.name.empty() ? builtin_type_word(type.type) : std::string_view(type.name);
  const bool is_allowed =
      type.name.empty() ? is_numeric(type.type) : type.type == DataType::pod_t || type.type == DataType::namedarray_t;
  if (!is_allowed) {
    scope.error("memory-type", member.line, word, found + "numbers, a pod or a namedarray");
  } else if (type.array != ArrayKind::variable && type.array != ArrayKind::multidim) {
    scope.error("memory-type", member.line, word, found + "the array form [] or [*]");
  } else if (is_generator_type(type)) {
    scope.error("memory-type", member.line, word, found + "no container");
  } else if (type.container != ContainerKind::none) {
    scope.relaxed("memory-type", member.line, word, found + "no container");
  }
}

void verify_objref(VerifyScope& scope, MemberDefinition& member) {
  if (!resolve_type(scope, member.type, member.line)) return;
  const auto& type = member.type;
  const auto found = "objref " + quote(member.name) + ": found the type " + quote(format_type(type)) + ", expected ";
  const auto word = type.name.empty() ? builtin_type_word(type.type) : std::string_view(type.name);
  const bool is_object = type.name.empty() ? type.type == DataType::varobject_t : type.type == DataType::object_t;
  if (!is_object) {
    scope.error("objref-type", member.line, word, found + "the name of an object or varobject");
    return;
  }
  constexpr std::string_view forms = "at most one index: [], {int32} or {string}";
  const bool is_map = type.container == ContainerKind::map_int32 || type.container == ContainerKind::map_string;
  if (type.array == ArrayKind::variable && type.container != ContainerKind::none) {
    scope.relaxed("objref-type", member.line, word, found + std::string(forms));
  } else if ((type.array != ArrayKind::none && type.array != ArrayKind::variable) ||
             (type.container != ContainerKind::none && !is_map)) {
    scope.error("objref-type", member.line, word, found + std::string(forms));
  }
}

void verify_member(VerifyScope& scope, MemberDefinition& member) {
  switch (member.kind) {
    case MemberKind::function:
    case MemberKind::callback:
    case MemberKind::event:
      return verify_call(scope, member);
    case MemberKind::memory:
      return verify_memory(scope, member);
    case MemberKind::objref:
      return verify_objref(scope, member);
    case MemberKind::field:
    case MemberKind::property:
    case MemberKind::pipe:
    case MemberKind::wire:
      if (!resolve_type(scope, member.type, member.line)) return;
      check_value_type(scope, member.type, member.line,
                       std::string(member_kind_name(member.kind)) + ' ' + quote(member.name));
  }
}

}  // namespace

void verify_members(VerifyScope& scope) {
  for (auto& entity : scope.definition->entities) {
    ConstantNames constants;
    for (const auto& constant : entity.constants) constants.insert(constant.name);
    for (auto& member : entity.members) {
      if (entity.kind == EntityKind::object) verify_member(scope, member);
      if (!member.modifiers.empty()) verify_modifiers(scope, member, constants);
    }
  }
}

}  // namespace rr
