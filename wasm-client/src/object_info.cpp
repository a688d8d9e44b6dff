#include "wasm-client/src/object_info.hpp"

#include <array>

#include "core/robdef/parse/statement.hpp"

namespace rr {

namespace {

void set_text(const JsValue& object, std::string_view name, std::string_view text) {
  set_js_field(object, name, make_js_text(text));
}

/// An array of objects, each with the name and the documentation of its item, and what `fill` adds.
template <class Items, class Fill>
JsValue make_list(const Items& items, Fill fill) {
  const JsValue list = make_js_array();
  for (const auto& item : items) {
    const JsValue object = make_js_object();
    set_text(object, "name", item.name);
    if constexpr (requires { item.documentation; }) set_text(object, "documentation", item.documentation);
    fill(object, item);
    push_js(list, object);
  }
  return list;
}

std::string modifier_text(const Modifier& modifier) {
  if (modifier.arguments.empty()) return modifier.name;
  std::string text = modifier.name + "(";
  for (std::size_t i = 0; i < modifier.arguments.size(); ++i) text += (i == 0 ? "" : ",") + modifier.arguments[i];
  return text + ")";
}

/// A service definition, or one of its structs, pods, namedarrays and objects.
template <class Definition>
JsValue make_js_constants(const Definition& definition) {
  auto constants = option_constants(definition.options);
  constants.insert(constants.end(), definition.constants.begin(), definition.constants.end());
  return make_list(constants, [](const JsValue& object, const ConstantDefinition& constant) {
    set_text(object, "type", format_type(constant.type));
    set_text(object, "text", constant.value_text);
  });
}

}  // namespace

JsValue make_js_members(const EntityDefinition& entity) {
  return make_list(entity.members, [](const JsValue& info, const MemberDefinition& member) {
    set_text(info, "kind", member_kind_name(member.kind));
    set_text(info, "type", format_type(member.type));
    set_js_field(info, "parameters",
                 make_list(member.parameters, [](const JsValue& item, const ParameterDefinition& parameter) {
                   set_text(item, "type", format_type(parameter.type));
                 }));
    const JsValue modifiers = make_js_array();
    for (const auto& modifier : member.modifiers) push_js(modifiers, make_js_text(modifier_text(modifier)));
    set_js_field(info, "modifiers", modifiers);
  });
}

JsValue make_js_definition(const ServiceDefinition& definition) {
  const JsValue info = make_js_object();
  set_text(info, "name", definition.name);
  set_text(info, "documentation", definition.documentation);
  set_js_field(info, "constants", make_js_constants(definition));
  set_js_field(info, "enums", make_list(definition.enums, [](const JsValue& item, const EnumDefinition& each) {
                 set_js_field(item, "values",
                              make_list(each.values, [](const JsValue& to, const EnumValueDefinition& value) {
                                set_js_field(to, "value", make_js_number(value.value));
                              }));
               }));
  set_js_field(info, "exceptions", make_list(definition.exceptions, [](const auto&, const auto&) {}));
  set_js_field(info, "types", make_list(definition.entities, [](const JsValue& item, const EntityDefinition& each) {
                 constexpr std::array<std::string_view, 4> kinds{"struct", "pod", "namedarray", "object"};
                 set_text(item, "kind", kinds[static_cast<std::size_t>(each.kind)]);
                 set_js_field(item, "constants", make_js_constants(each));
                 set_js_field(item, "members", make_js_members(each));
                 const JsValue implemented = make_js_array();
                 for (const auto& type : each.implements) push_js(implemented, make_js_text(type.qualified_name));
                 set_js_field(item, "implements", implemented);
               }));
  return info;
}

}  // namespace rr
