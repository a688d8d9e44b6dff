#include "core/types/type_text.hpp"

#include <algorithm>

namespace rr {

namespace {

bool is_type_character(char c) {
  return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') ||
         std::string_view("_.[]{},*-").find(c) != std::string_view::npos;
}

}  // namespace

Result<TypeDefinition> parse_type_text(std::string_view text, const TypeRegistry& types) {
  const auto refuse = [&](std::string_view why) {
    return make_error(ErrorCode::invalid_argument, "type " + quote(text) + " " + std::string(why));
  };
  if (text.empty() || !std::all_of(text.begin(), text.end(), is_type_character))
    return refuse("is not written as in a service definition");
  // The parser reads definitions: the type gets one around it.
  const auto parsed =
      parse_service_definition("service t\nobject o\nproperty " + std::string(text) + " p\nend\n", RobdefMode::compat);
  if (!parsed.ok() || parsed.definition.entities.size() != 1 || parsed.definition.entities[0].members.size() != 1)
    return refuse("is not written as in a service definition");
  auto type = parsed.definition.entities[0].members[0].type;
  if (type.type == DataType::varvalue_t && type.container != ContainerKind::none &&
      type.container != ContainerKind::generator)
    return type;
  if (type.type == DataType::varvalue_t || type.container == ContainerKind::generator || type.type == DataType::void_t)
    return refuse("is not the type of a value");
  if (type.type == DataType::string_t && type.array != ArrayKind::none)
    return refuse("is no type: strings have no arrays; write string{list}");
  if (item_size(type.type) != 0) return type;
  type.qualified_name = type.name;
  if (types.find_enum(type.name)) {
    type.type = DataType::enum_t;
    return type;
  }
  const auto* entity = types.find_entity(type.name);
  if (!entity) return refuse("is not known; write named types with their service, as in \"com.example.Pose\"");
  switch (entity->kind) {
    case EntityKind::structure:
      type.type = DataType::structure_t;
      break;
    case EntityKind::pod:
      type.type = DataType::pod_t;
      break;
    case EntityKind::namedarray:
      type.type = DataType::namedarray_t;
      break;
    case EntityKind::object:
      return refuse("is an object, not the type of a value");
  }
  return type;
}

}  // namespace rr
