#include "server/json/schema.hpp"

#include "core/types/multidim.hpp"

namespace rr {

namespace {

OrderedJson reference(const std::string& qualified_name) {
  return {{"$ref", "#/components/schemas/" + qualified_name}};
}

OrderedJson or_null(OrderedJson schema) {
  return {{"oneOf", {std::move(schema), {{"type", "null"}}}}};
}

OrderedJson integer(std::int64_t minimum, std::int64_t maximum) {
  return {{"type", "integer"}, {"minimum", minimum}, {"maximum", maximum}};
}

OrderedJson number_schema(DataType type) {
  switch (type) {
    case DataType::double_t:
    case DataType::single_t:
      return {{"oneOf",
               {{{"type", "number"}, {"format", type == DataType::double_t ? "double" : "float"}},
                {{"enum", {"NaN", "Infinity", "-Infinity"}}}}}};
    case DataType::int8_t:
      return integer(-128, 127);
    case DataType::uint8_t:
      return integer(0, 255);
    case DataType::int16_t:
      return integer(-32768, 32767);
    case DataType::uint16_t:
      return integer(0, 65535);
    case DataType::int32_t:
      return integer(-2147483648LL, 2147483647);
    case DataType::uint32_t:
      return integer(0, 4294967295LL);
    case DataType::int64_t:
      return {{"type", "string"}, {"format", "int64"}, {"pattern", "^(0|-?[1-9][0-9]*)$"}};
    case DataType::uint64_t:
      return {{"type", "string"}, {"format", "uint64"}, {"pattern", "^(0|[1-9][0-9]*)$"}};
    case DataType::cdouble_t:
    case DataType::csingle_t:
      return {{"type", "array"},
              {"items", number_schema(type == DataType::cdouble_t ? DataType::double_t : DataType::single_t)},
              {"minItems", 2},
              {"maxItems", 2},
              {"description", "real, imaginary"}};
    case DataType::bool_t:
      return {{"type", "boolean"}};
    default:
      return OrderedJson::object();
  }
}

/// One value of the base type: no array, no container.
OrderedJson base_schema(const TypeDefinition& type) {
  switch (type.type) {
    case DataType::void_t:
      return {{"type", "null"}};
    case DataType::string_t:
      return {{"type", "string"}};
    case DataType::varvalue_t:
      return {{"type", {"object", "null"}},
              {"properties", {{"type", {{"type", "string"}}}, {"value", OrderedJson::object()}}},
              {"required", {"type", "value"}},
              {"additionalProperties", false}};
    case DataType::structure_t:
      return or_null(reference(type.qualified_name));
    case DataType::enum_t:
    case DataType::pod_t:
    case DataType::namedarray_t:
      return reference(type.qualified_name);
    default:
      return number_schema(type.type);
  }
}

/// Lengths that a declared one-dimensional array may have.
void set_lengths(const TypeDefinition& type, OrderedJson& schema, const char* minimum, const char* maximum,
                 std::int64_t (*length_of)(std::int64_t)) {
  if (type.sizes.empty()) return;
  if (type.array == ArrayKind::fixed) schema[minimum] = length_of(type.sizes[0]);
  if (type.array == ArrayKind::fixed || type.array == ArrayKind::max) schema[maximum] = length_of(type.sizes[0]);
}

OrderedJson list_schema(const TypeDefinition& type) {
  if (type.type == DataType::uint8_t) {
    OrderedJson out{{"type", "string"}, {"contentEncoding", "base64"}};
    set_lengths(type, out, "minLength", "maxLength", [](std::int64_t n) { return 4 * ((n + 2) / 3); });
    return out;
  }
  OrderedJson out{{"type", "array"}, {"items", base_schema(type)}};
  set_lengths(type, out, "minItems", "maxItems", [](std::int64_t n) { return n; });
  return out;
}

OrderedJson item_schema(const TypeDefinition& type) {
  if (type.array == ArrayKind::none) return base_schema(type);
  if (!is_multidim(type)) return list_schema(type);
  OrderedJson dims{{"type", "array"}, {"items", integer(0, 4294967295LL)}, {"minItems", 1}};
  if (type.array == ArrayKind::fixed_multidim) dims = {{"const", type.sizes}};
  auto items = type;
  items.array = ArrayKind::variable;
  items.sizes.clear();
  return {{"type", "object"},
          {"properties", {{"dims", std::move(dims)}, {"data", list_schema(items)}}},
          {"required", {"dims", "data"}},
          {"additionalProperties", false},
          {"description", "column-major: the first index is the fastest"}};
}

OrderedJson fields_schema(const EntityDefinition& entity, NoteDocumentation note) {
  OrderedJson out{{"type", "object"}};
  auto& properties = out["properties"] = OrderedJson::object();
  auto required = OrderedJson::array();
  for (const auto& member : entity.members) {
    auto schema = type_schema(member.type);
    if (!member.documentation.empty()) note(schema, member.documentation);
    add_key(properties, member.name) = std::move(schema);
    required.push_back(member.name);
  }
  if (!required.empty()) out["required"] = std::move(required);
  out["additionalProperties"] = false;
  if (!entity.documentation.empty()) note(out, entity.documentation);
  out["x-rr-type"] = entity.qualified_name;
  return out;
}

OrderedJson enum_schema(const EnumDefinition& definition, const std::string& qualified_name, NoteDocumentation note) {
  auto names = OrderedJson::array();
  auto values = OrderedJson::object();
  for (const auto& value : definition.values) {
    names.push_back(value.name);
    add_key(values, value.name) = value.value;
  }
  OrderedJson out{{"anyOf", {{{"type", "string"}, {"enum", std::move(names)}}, integer(-2147483648LL, 2147483647)}}};
  out["x-rr-type"] = qualified_name;
  out["x-rr-values"] = std::move(values);
  if (!definition.documentation.empty()) note(out, definition.documentation);
  return out;
}

void describe_by(OrderedJson& schema, const std::string& documentation) {
  schema["description"] = documentation;
}

}  // namespace

OrderedJson type_schema(const TypeDefinition& type) {
  OrderedJson out;
  switch (type.container) {
    case ContainerKind::none:
    case ContainerKind::generator:
      out = item_schema(type);
      break;
    case ContainerKind::list:
      out = {{"type", {"array", "null"}}, {"items", item_schema(type)}};
      break;
    case ContainerKind::map_int32:
      out = {{"type", {"object", "null"}},
             {"propertyNames", {{"pattern", "^(0|-?[1-9][0-9]*)$"}}},
             {"additionalProperties", item_schema(type)}};
      break;
    case ContainerKind::map_string:
      out = {{"type", {"object", "null"}}, {"additionalProperties", item_schema(type)}};
      break;
  }
  auto named = type;
  if (!named.qualified_name.empty()) named.name = named.qualified_name;
  out["x-rr-type"] = format_type(named);
  return out;
}

OrderedJson arguments_schema(const MemberDefinition& member) {
  OrderedJson out{{"type", "object"}};
  auto& properties = out["properties"] = OrderedJson::object();
  auto required = OrderedJson::array();
  for (const auto& parameter : member.parameters) {
    if (&parameter == member.step_parameter()) continue;
    add_key(properties, parameter.name) = type_schema(parameter.type);
    required.push_back(parameter.name);
  }
  if (!required.empty()) out["required"] = std::move(required);
  out["additionalProperties"] = false;
  return out;
}

std::optional<OrderedJson> named_type_schema(const TypeRegistry& types, const std::string& qualified_name,
                                             NoteDocumentation note) {
  if (const auto* definition = types.find_enum(qualified_name)) return enum_schema(*definition, qualified_name, note);
  if (const auto* entity = types.find_entity(qualified_name)) return fields_schema(*entity, note);
  return std::nullopt;
}

OrderedJson named_type_schemas(const TypeRegistry& types) {
  auto out = OrderedJson::object();
  for (const auto& definition : types.definitions()) {
    for (const auto& each : definition->enums) {
      const auto name = definition->name + "." + each.name;
      add_key(out, name) = enum_schema(each, name, describe_by);
    }
    for (const auto& entity : definition->entities)
      if (entity.kind != EntityKind::object) add_key(out, entity.qualified_name) = fields_schema(entity, describe_by);
  }
  return out;
}

}  // namespace rr
