#include "core/robdef/format/statement_text.hpp"

#include <charconv>
#include <iterator>

#include "core/robdef/model/names.hpp"

namespace rr {

namespace {

std::string hex_literal(std::int32_t value) {
  const auto wide = std::int64_t{value};
  char digits[8];
  const auto end = std::to_chars(std::begin(digits), std::end(digits), wide < 0 ? -wide : wide, 16).ptr;
  return (value < 0 ? "-0x" : "0x") + std::string(digits, end);
}

}  // namespace

std::string using_text(const UsingDefinition& item) {
  const bool is_renamed = split_qualified(item.qualified_name).name != item.alias;
  return "using " + item.qualified_name + (is_renamed ? " as " + item.alias : "");
}

std::string constant_text(const ConstantDefinition& item) {
  // Aliases do not apply to the type word of a constant.
  return "constant " + format_type(item.type) + ' ' + item.name + ' ' + item.value_text;
}

std::string enum_value_text(const EnumValueDefinition& item) {
  if (item.is_implicit) return item.name;
  return item.name + " = " + (item.is_hex ? hex_literal(item.value) : std::to_string(item.value));
}

std::string entity_header_text(const EntityDefinition& item) {
  constexpr std::string_view keywords[] = {"struct", "pod", "namedarray", "object"};
  return std::string(keywords[static_cast<std::size_t>(item.kind)]) + ' ' + item.name;
}

std::string member_text(const MemberDefinition& item, const CanonicalNames* names) {
  const auto type_text = [names](const TypeDefinition& type) { return format_type(names ? names->type(type) : type); };
  std::string out = std::string(member_kind_name(item.kind)) + ' ';
  if (item.kind != MemberKind::event) out += type_text(item.type) + ' ';
  out += item.name;
  if (item.kind == MemberKind::function || item.kind == MemberKind::callback || item.kind == MemberKind::event) {
    out += '(';
    for (std::size_t i = 0; i < item.parameters.size(); ++i) {
      if (i != 0) out += ", ";
      out += type_text(item.parameters[i].type) + ' ' + item.parameters[i].name;
    }
    out += ')';
  }
  for (std::size_t i = 0; i < item.modifiers.size(); ++i) {
    const auto& modifier = item.modifiers[i];
    out += i == 0 ? " [" : ",";
    out += modifier.text.empty() ? modifier.name : modifier.text;
  }
  return item.modifiers.empty() ? out : out + ']';
}

}  // namespace rr
