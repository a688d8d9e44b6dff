#include "server/json/arguments.hpp"

#include <algorithm>

namespace rr {

Result<std::vector<Value>> arguments_from_json(const Json& json, const MemberDefinition& member,
                                               const TypeRegistry& types, const JsonForm& form) {
  std::vector<Value> out;
  const auto refused = [&](std::string why) {
    return make_error(ErrorCode::invalid_argument, member.name + " " + std::move(why));
  };
  if (!json.is_object()) return refused("takes its parameters as an object {\"name\": value}");
  for (const auto& parameter : member.parameters) {
    if (parameter.type.container == ContainerKind::generator) continue;
    const auto found = json.find(parameter.name);
    if (found == json.end())
      return refused("misses the parameter " + rr::quote(parameter.name) + " (" + format_type(parameter.type) + ")");
    auto value = value_from_json(*found, parameter.type, types, form, parameter.name);
    if (!value) return value.error();
    out.push_back(std::move(*value));
  }
  for (const auto& [key, unused] : json.items()) {
    const auto is_known = std::any_of(member.parameters.begin(), member.parameters.end(),
                                      [&key = key](const auto& parameter) { return parameter.name == key; });
    if (!is_known) return refused("has no parameter " + rr::quote(key));
  }
  return out;
}

Result<OrderedJson> arguments_to_json(std::span<const Value> arguments, const MemberDefinition& member,
                                      const TypeRegistry& types, const JsonForm& form) {
  auto out = OrderedJson::object();
  for (std::size_t i = 0; i < member.parameters.size() && i < arguments.size(); ++i) {
    const auto& parameter = member.parameters[i];
    auto json = value_to_json(arguments[i], parameter.type, types, form, parameter.name);
    if (!json) return json.error();
    add_key(out, parameter.name) = std::move(*json);
  }
  return {boost::system::in_place_value, std::move(out)};
}

}  // namespace rr
