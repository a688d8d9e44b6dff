#include "wasm-client/src/object_info.hpp"

#include <array>

#include "core/robdef/parse/statement.hpp"

namespace rr {

namespace {

/// An array of objects, each with the name and the documentation of its item, and what `fill` adds.
template <class Items, class Fill>
void write_list(JsWriter& js, const Items& items, Fill fill) {
  js.begin_array();
  for (const auto& item : items) {
    js.begin_object();
    js.key("name").text(item.name);
    if constexpr (requires { item.documentation; }) js.key("documentation").text(item.documentation);
    fill(item);
    js.end();
  }
  js.end();
}

std::string modifier_text(const Modifier& modifier) {
  if (modifier.arguments.empty()) return modifier.name;
  std::string text = modifier.name + "(";
  for (std::size_t i = 0; i < modifier.arguments.size(); ++i) text += (i == 0 ? "" : ",") + modifier.arguments[i];
  return text + ")";
}

/// Of a service definition, or of one of its structs, pods, namedarrays and objects.
template <class Definition>
void write_constants(JsWriter& js, const Definition& definition) {
  auto constants = option_constants(definition.options);
  constants.insert(constants.end(), definition.constants.begin(), definition.constants.end());
  write_list(js, constants, [&](const ConstantDefinition& constant) {
    js.key("type").text(format_type(constant.type));
    js.key("text").text(constant.value_text);
  });
}

void write_members(JsWriter& js, const EntityDefinition& entity) {
  write_list(js, entity.members, [&](const MemberDefinition& member) {
    js.key("kind").text(member_kind_name(member.kind));
    js.key("type").text(format_type(member.type));
    js.key("parameters");
    write_list(js, member.parameters,
               [&](const ParameterDefinition& parameter) { js.key("type").text(format_type(parameter.type)); });
    js.key("modifiers").begin_array();
    for (const auto& modifier : member.modifiers) js.text(modifier_text(modifier));
    js.end();
  });
}

void write_entity(JsWriter& js, const EntityDefinition& entity) {
  constexpr std::array<std::string_view, 4> kinds{"struct", "pod", "namedarray", "object"};
  js.key("kind").text(kinds[static_cast<std::size_t>(entity.kind)]);
  js.key("constants");
  write_constants(js, entity);
  js.key("members");
  write_members(js, entity);
  js.key("implements").begin_array();
  for (const auto& type : entity.implements) js.text(type.qualified_name);
  js.end();
}

}  // namespace

JsValue make_js_members(const EntityDefinition& entity) {
  JsWriter js;
  write_members(js, entity);
  return js.build();
}

JsValue make_js_definition(const ServiceDefinition& definition) {
  JsWriter js;
  js.begin_object();
  js.key("name").text(definition.name);
  js.key("documentation").text(definition.documentation);
  js.key("constants");
  write_constants(js, definition);
  js.key("enums");
  write_list(js, definition.enums, [&](const EnumDefinition& each) {
    js.key("values");
    write_list(js, each.values, [&](const EnumValueDefinition& value) { js.key("value").number(value.value); });
  });
  js.key("exceptions");
  write_list(js, definition.exceptions, [](const auto&) {});
  js.key("types");
  write_list(js, definition.entities, [&](const EntityDefinition& each) { write_entity(js, each); });
  return js.build();
}

}  // namespace rr
