#include "core/robdef/model/service_definition.hpp"

#include <algorithm>

#include "core/robdef/model/names.hpp"
#include "core/support/words.hpp"

namespace rr {

namespace {

template <class T>
const T* find_named(const std::vector<T>& items, std::string_view name) {
  const auto found = std::find_if(items.begin(), items.end(), [name](const T& item) { return item.name == name; });
  return found == items.end() ? nullptr : &*found;
}

}  // namespace

std::string_view member_kind_name(MemberKind kind) {
  switch (kind) {
    case MemberKind::field:
      return "field";
    case MemberKind::property:
      return "property";
    case MemberKind::function:
      return "function";
    case MemberKind::event:
      return "event";
    case MemberKind::objref:
      return "objref";
    case MemberKind::pipe:
      return "pipe";
    case MemberKind::callback:
      return "callback";
    case MemberKind::wire:
      return "wire";
    case MemberKind::memory:
      return "memory";
  }
  return "unknown";
}

bool MemberDefinition::has_modifier(std::string_view modifier) const {
  return find_named(modifiers, modifier);
}

MemberDirection MemberDefinition::direction() const {
  if (has_modifier("readonly")) return MemberDirection::readonly;
  if (has_modifier("writeonly")) return MemberDirection::writeonly;
  return MemberDirection::both;
}

bool MemberDefinition::is_generator() const {
  return kind == MemberKind::function && (type.container == ContainerKind::generator || step_parameter());
}

const ParameterDefinition* MemberDefinition::step_parameter() const {
  if (parameters.empty() || parameters.back().type.container != ContainerKind::generator) return nullptr;
  return &parameters.back();
}

const MemberDefinition* EntityDefinition::find_member(std::string_view member) const {
  return find_named(members, member);
}

bool EntityDefinition::is_unreliable_pipe(const MemberDefinition& pipe) const {
  if (pipe.kind != MemberKind::pipe) return false;
  if (pipe.has_modifier("unreliable")) return true;
  return std::any_of(options.begin(), options.end(), [&pipe](const OptionDefinition& option) {
    return split_words(option.text) == std::vector<std::string_view>{"pipe", pipe.name, "unreliable"};
  });
}

const EntityDefinition* ServiceDefinition::find_entity(std::string_view entity) const {
  return find_named(entities, entity);
}

const EnumDefinition* ServiceDefinition::find_enum(std::string_view enumeration) const {
  return find_named(enums, enumeration);
}

const ExceptionDefinition* ServiceDefinition::find_exception(std::string_view exception) const {
  return find_named(exceptions, exception);
}

}  // namespace rr
