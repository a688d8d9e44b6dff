// Structures, pods and named arrays from objects. Layer: wasm-client/src.
#include "core/types/multidim.hpp"
#include "wasm-client/src/value_from_js.hpp"

namespace rr {

bool FromJs::read_named(const FieldPath& path, const JsValue& js, const TypeDefinition& type, Value& out) {
  const std::string_view type_name = type.qualified_name;
  const auto* entity = types_.find_entity(type_name);
  if (!entity || entity->kind == EntityKind::object)
    return fail(ErrorCode::data_type_error, path, quote(type_name) + (entity ? " is an object" : " is not known"));
  if (entity->kind == EntityKind::structure) {
    if (js.is_nullish()) return true;
    Structure structure;
    structure.type_name = type_name;
    if (!read_fields(path, js, *entity, type_name, structure)) return false;
    out = std::move(structure);
    return true;
  }

  const bool is_scalar = type.array == ArrayKind::none;
  const bool has_shape = is_multidim(type);
  std::vector<std::uint32_t> dims;
  auto data = js;
  if (has_shape && !read_shape(path, js, dims, data)) return false;
  if (entity->kind == EntityKind::pod) {
    PodArray pods;
    pods.type_name = type_name;
    if (is_scalar ? !read_fields(path, data, *entity, type_name, pods.items.emplace_back())
                  : !read_pods(path, data, *entity, type_name, pods))
      return false;
    pods.dims = std::move(dims);
    pods.is_scalar = is_scalar;
    pods.is_multidim = has_shape;
    out = std::move(pods);
  } else {
    NamedArray named;
    Bytes numbers;
    if (is_scalar ? !flatten(path, data, *entity, type_name, numbers)
                  : !read_named_arrays(path, data, *entity, type_name, numbers))
      return false;
    named.type_name = type_name;
    named.array = Array::copy(entity->namedarray_type, numbers);
    named.dims = std::move(dims);
    named.is_scalar = is_scalar;
    named.is_multidim = has_shape;
    out = std::move(named);
  }
  return true;
}

bool FromJs::read_fields(const FieldPath& path, const JsValue& js, const EntityDefinition& entity,
                         std::string_view type_name, Structure& out) {
  if (js.kind() != JsKind::object)
    return fail_mismatch(path, js, "an object with the fields of " + std::string(type_name));
  out.fields.reserve(entity.members.size());
  for (const auto& member : entity.members) {
    const auto at = path.field(member.name, type_name);
    std::optional<JsValue> item;
    if (!field_of(at, js, member.name, item) || !check_there(at, *item, member.type)) return false;
    out.fields.push_back({member.name, {}});
    if (!read(at, *item, member.type, out.fields.back().value)) return false;
  }
  return check_keys(path, js, entity, type_name);
}

/// A field that may be null may also be left out.
bool FromJs::check_there(const FieldPath& path, const JsValue& js, const TypeDefinition& type) {
  const bool may_be_null =
      type.container != ContainerKind::none || type.type == DataType::structure_t || type.type == DataType::varvalue_t;
  if (may_be_null || js.kind() != JsKind::undefined) return true;
  return fail(ErrorCode::data_type_error, path, "is missing, expected " + format_type(type));
}

/// A misspelt field must not be dropped silently.
bool FromJs::check_keys(const FieldPath& path, const JsValue& js, const EntityDefinition& entity,
                        std::string_view type_name) {
  const auto keys = js.keys();
  if (!keys) return fail_throwing(path);
  const auto count = keys->length();
  for (std::size_t i = 0; count && i < *count; ++i) {
    const auto key = keys->at(i)->text();
    if (!key || !entity.find_member(*key))
      return fail(ErrorCode::data_type_error, path.field(key ? *key : "?", type_name), "is not a field of the type");
  }
  return true;
}

bool FromJs::read_pods(const FieldPath& path, const JsValue& js, const EntityDefinition& entity,
                       std::string_view type_name, PodArray& out) {
  if (js.kind() != JsKind::array) return fail_mismatch(path, js, "an array of objects");
  std::size_t count = 0;
  if (!read_length(path, js, count)) return false;
  out.items.reserve(count);
  for (std::size_t i = 0; i < count; ++i) {
    const auto at = path.index(static_cast<std::int32_t>(i));
    std::optional<JsValue> item;
    if (!item_at(at, js, i, item) || !read_fields(at, *item, entity, type_name, out.items.emplace_back())) return false;
  }
  return true;
}

/// An array of objects, or all numbers in one array.
bool FromJs::read_named_arrays(const FieldPath& path, const JsValue& js, const EntityDefinition& entity,
                               std::string_view type_name, Bytes& out) {
  const auto kind = js.kind();
  if (kind != JsKind::array && kind != JsKind::items)
    return fail_mismatch(path, js, "an array of objects, or of their numbers");
  std::size_t count = 0;
  if (!read_length(path, js, count)) return false;
  const auto first = count == 0 ? JsValue::undefined() : js.at(0).value_or(JsValue::undefined());
  if (kind == JsKind::items || first.kind() == JsKind::number || first.kind() == JsKind::bigint) {
    Array array;
    if (!read_array(path, js, entity.namedarray_type, array)) return false;
    out.assign(array.bytes().begin(), array.bytes().end());
    return true;
  }
  for (std::size_t i = 0; i < count; ++i) {
    const auto at = path.index(static_cast<std::int32_t>(i));
    std::optional<JsValue> item;
    if (!item_at(at, js, i, item) || !flatten(at, *item, entity, type_name, out)) return false;
  }
  return true;
}

/// Adds the numbers of one value, which is an object by fields or an array of all its numbers.
bool FromJs::flatten(const FieldPath& path, const JsValue& js, const EntityDefinition& entity,
                     std::string_view type_name, Bytes& out) {
  const Level level(depth_);
  if (depth_ > max_depth) return fail(ErrorCode::data_type_error, path, "is nested too deeply");
  const auto kind = js.kind();
  if (kind == JsKind::items || kind == JsKind::array) {
    Array array;
    if (!read_array(path, js, entity.namedarray_type, array)) return false;
    if (array.size() != entity.namedarray_count)
      return fail(
          ErrorCode::data_type_error, path,
          "has " + std::to_string(array.size()) + " numbers, expected " + std::to_string(entity.namedarray_count));
    out.insert(out.end(), array.bytes().begin(), array.bytes().end());
    return true;
  }
  if (kind != JsKind::object) return fail_mismatch(path, js, "an object with the fields of " + std::string(type_name));

  for (const auto& member : entity.members) {
    const auto at = path.field(member.name, type_name);
    std::optional<JsValue> item;
    Value value;
    if (!field_of(at, js, member.name, item) || !check_there(at, *item, member.type) ||
        !read(at, *item, member.type, value))
      return false;
    std::size_t expected = item_size(entity.namedarray_type);
    for (const auto size : member.type.sizes) expected *= static_cast<std::size_t>(size);
    if (member.type.type == DataType::namedarray_t)
      if (const auto* inner = types_.find_entity(member.type.qualified_name)) expected *= inner->namedarray_count;
    ByteSpan bytes;
    if (const auto* scalar = value.get_if<Scalar>()) bytes = scalar->bytes();
    if (const auto* array = value.get_if<Array>()) bytes = array->bytes();
    if (const auto* multidim = value.get_if<MultiDimArray>()) bytes = multidim->array.bytes();
    if (const auto* named = value.get_if<NamedArray>()) bytes = named->array.bytes();
    if (bytes.size() != expected)
      return fail(ErrorCode::data_type_error, at,
                  "has " + std::to_string(bytes.size() / item_size(entity.namedarray_type)) + " numbers, expected " +
                      format_type(member.type));
    out.insert(out.end(), bytes.begin(), bytes.end());
  }
  return check_keys(path, js, entity, type_name);
}

}  // namespace rr
