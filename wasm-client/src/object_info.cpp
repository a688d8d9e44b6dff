#include "wasm-client/src/object_info.hpp"

namespace rr {

namespace {

std::string modifier_text(const Modifier& modifier) {
  if (modifier.arguments.empty()) return modifier.name;
  std::string text = modifier.name + "(";
  for (std::size_t i = 0; i < modifier.arguments.size(); ++i) text += (i == 0 ? "" : ",") + modifier.arguments[i];
  return text + ")";
}

}  // namespace

JsValue make_js_members(const EntityDefinition& entity) {
  const JsValue members = make_js_array();
  for (const auto& member : entity.members) {
    const JsValue info = make_js_object();
    set_js_field(info, "name", make_js_text(member.name));
    set_js_field(info, "kind", make_js_text(member_kind_name(member.kind)));
    set_js_field(info, "type", make_js_text(format_type(member.type)));
    const JsValue parameters = make_js_array();
    for (const auto& parameter : member.parameters) {
      const JsValue item = make_js_object();
      set_js_field(item, "name", make_js_text(parameter.name));
      set_js_field(item, "type", make_js_text(format_type(parameter.type)));
      push_js(parameters, item);
    }
    set_js_field(info, "parameters", parameters);
    const JsValue modifiers = make_js_array();
    for (const auto& modifier : member.modifiers) push_js(modifiers, make_js_text(modifier_text(modifier)));
    set_js_field(info, "modifiers", modifiers);
    set_js_field(info, "documentation", make_js_text(member.documentation));
    push_js(members, info);
  }
  return members;
}

}  // namespace rr
