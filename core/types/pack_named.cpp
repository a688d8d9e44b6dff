// Packing of structures, pods and named arrays.
#include "core/types/multidim.hpp"
#include "core/types/packer.hpp"

namespace rr {

bool Packer::pack_named(const FieldPath& path, const Value& value, const TypeDefinition& type, Place place) {
  const auto* entity = types_.find_entity(type.qualified_name);
  if (!entity) return fail(ErrorCode::data_type_error, path, "type " + quote(type.qualified_name) + " is not known");
  const std::string_view type_name = type.qualified_name;
  const bool as_multidim = is_multidim(type) && place == Place::anywhere;
  switch (entity->kind) {
    case EntityKind::structure:
      if (value.is_null()) return add_leaf(path, DataType::void_t, 0, {});
      if (const auto* structure = value.get_if<Structure>())
        return pack_structure(path, *structure, *entity, type_name);
      break;
    case EntityKind::pod:
      if (const auto* pod = value.get_if<Structure>(); pod && type.array == ArrayKind::none)
        return pack_pod_items(path, path, {pod, 1}, *entity, type_name);
      if (const auto* pods = value.get_if<PodArray>())
        return check_shape(path, *pods, pods->items.size(), type) &&
               pack_pods(path, *pods, *entity, type_name, as_multidim);
      break;
    case EntityKind::namedarray:
      if (const auto* named = value.get_if<NamedArray>()) {
        const auto count = count_named_arrays(path, *named, *entity);
        return count && check_shape(path, *named, *count, type) &&
               pack_named_arrays(path, *named, *entity, type_name, as_multidim);
      }
      break;
    case EntityKind::object:
      return fail(ErrorCode::data_type_error, path, "an object is not a value");
  }
  return fail_mismatch(path, value, item_type_text(type));
}

bool Packer::pack_named_varvalue(const FieldPath& path, const Value& value, std::string_view type_name) {
  const auto* entity = types_.find_entity(type_name);
  if (!entity) return fail(ErrorCode::data_type_error, path, "type " + quote(type_name) + " is not known");
  if (const auto* structure = value.get_if<Structure>()) {
    if (entity->kind == EntityKind::structure) return pack_structure(path, *structure, *entity, type_name);
    if (entity->kind == EntityKind::pod) return pack_pod_items(path, path, {structure, 1}, *entity, type_name);
  }
  if (const auto* pods = value.get_if<PodArray>(); pods && entity->kind == EntityKind::pod)
    return pack_pods(path, *pods, *entity, type_name, pods->is_multidim);
  if (const auto* named = value.get_if<NamedArray>(); named && entity->kind == EntityKind::namedarray)
    return count_named_arrays(path, *named, *entity) &&
           pack_named_arrays(path, *named, *entity, type_name, named->is_multidim);
  return fail(ErrorCode::data_type_mismatch, path, std::string(type_name) + " is another kind of type than the value");
}

bool Packer::pack_structure(const FieldPath& path, const Structure& value, const EntityDefinition& entity,
                            std::string_view type_name) {
  return check_type_name(path, value.type_name, type_name) && begin_nested(path, DataType::structure_t, type_name) &&
         pack_fields(path, value, entity, type_name, Place::anywhere) && end_nested();
}

bool Packer::pack_fields(const FieldPath& path, const Structure& value, const EntityDefinition& entity,
                         std::string_view type_name, Place place) {
  const auto& given = value.fields;
  for (std::size_t i = 0; i < entity.members.size(); ++i) {
    const auto& member = entity.members[i];
    const auto at = path.field(member.name, type_name);
    const auto* field = i < given.size() && given[i].name == member.name ? &given[i].value : value.find(member.name);
    if (!field) return fail(ErrorCode::data_type_error, at, "is missing, expected " + format_type(member.type));
    if (!pack_value(at, *field, member.type, place)) return false;
  }
  // Every member was found under a name of its own: fields that are left over are unknown or there twice.
  if (given.size() == entity.members.size()) return true;
  for (const auto& field : given) {
    const auto at = path.field(field.name, type_name);
    if (!entity.find_member(field.name)) return fail(ErrorCode::data_type_error, at, "is not a field of the type");
    if (value.find(field.name) != &field.value) return fail(ErrorCode::data_type_error, at, "is there twice");
  }
  return true;
}

bool Packer::pack_pods(const FieldPath& path, const PodArray& value, const EntityDefinition& entity,
                       std::string_view type_name, bool as_multidim) {
  if (!check_type_name(path, value.type_name, type_name)) return false;
  if (!as_multidim) return pack_pod_items(path, path, value.items, entity, type_name);
  return begin_nested(path, DataType::pod_multidimarray_t, type_name) &&
         pack_dims(path, value.dims, value.items.size()) &&
         pack_pod_items(path, path.field("array", {}), value.items, entity, type_name) && end_nested();
}

bool Packer::pack_pod_items(const FieldPath& path, const FieldPath& key, std::span<const Structure> items,
                            const EntityDefinition& entity, std::string_view type_name) {
  if (!begin_nested(key, DataType::pod_array_t, type_name)) return false;
  std::int32_t position = 0;
  for (const auto& item : items) {
    const auto at = path.index(position++);
    if (!check_type_name(at, item.type_name, type_name) || !begin_nested(at, DataType::pod_t) ||
        !pack_fields(at, item, entity, type_name, Place::in_pod))
      return false;
    end_nested();
  }
  return end_nested();
}

bool Packer::pack_named_arrays(const FieldPath& path, const NamedArray& value, const EntityDefinition& entity,
                               std::string_view type_name, bool as_multidim) {
  if (!check_type_name(path, value.type_name, type_name)) return false;
  const auto array = path.field("array", {});
  const auto pack_values = [&](const FieldPath& key) {
    return begin_nested(key, DataType::namedarray_array_t, type_name) &&
           add_payload(array, entity.namedarray_type, value.array) && end_nested();
  };
  if (!as_multidim) return pack_values(path);
  return begin_nested(path, DataType::namedarray_multidimarray_t, type_name) &&
         pack_dims(path, value.dims, value.array.size() / entity.namedarray_count) && pack_values(array) &&
         end_nested();
}

std::optional<std::size_t> Packer::count_named_arrays(const FieldPath& path, const NamedArray& value,
                                                      const EntityDefinition& entity) {
  const std::size_t size = value.array.size();
  const std::size_t each = entity.namedarray_count;
  if (size != 0 && value.array.type() != entity.namedarray_type) {
    fail(ErrorCode::data_type_mismatch, path,
         "found " + std::string(data_type_name(value.array.type())) + " numbers, expected " +
             std::string(data_type_name(entity.namedarray_type)));
    return std::nullopt;
  }
  if (each == 0 || size % each != 0) {
    fail(ErrorCode::data_type_error, path,
         "has " + std::to_string(size) + " numbers, expected a multiple of " + std::to_string(each));
    return std::nullopt;
  }
  return size / each;
}

template <class Named>
bool Packer::check_shape(const FieldPath& path, const Named& value, std::size_t count, const TypeDefinition& type) {
  if (value.is_multidim != is_multidim(type)) return fail_mismatch(path, Value(value), item_type_text(type));
  if (!value.is_multidim) {
    const auto wrong = type.array == ArrayKind::none && count != 1 ? "has " + std::to_string(count) + ", expected 1"
                                                                   : wrong_count(type, count);
    return wrong.empty() || fail(ErrorCode::data_type_error, path, wrong + " (" + item_type_text(type) + ")");
  }
  const auto product = product_of(std::span<const std::uint32_t>(value.dims));
  if (product && *product == count && has_declared_dims(type, value.dims)) return true;
  return fail(
      ErrorCode::data_type_error, path,
      "has " + std::to_string(count) + " with dims " + dims_text(value.dims) + ", expected " + item_type_text(type));
}

bool Packer::check_type_name(const FieldPath& path, std::string_view found, std::string_view expected) {
  if (found.empty() || found == expected) return true;
  return fail(ErrorCode::data_type_error, path, "found type " + quote(found) + ", expected " + std::string(expected));
}

}  // namespace rr
