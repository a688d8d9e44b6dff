// Unpacking of structures, pods and named arrays.
#include <algorithm>
#include <functional>

#include "core/support/sort.hpp"
#include "core/types/multidim.hpp"
#include "core/types/unpacker.hpp"

namespace rr {

namespace {

/// Finds a structure's fields by name, first match (rule 8). While fields come in definition order, as from every
/// known writer, it only compares neighbours; the first surprise makes it build an index, so that no order is slow.
class FieldFinder {
 public:
  explicit FieldFinder(const ElementRange& children) : children_(children), next_(children.begin()) {}

  const MessageElement* find(std::string_view name) {
    if (!is_indexed_) {
      if (next_ != children_.end() && is_named(*next_, name)) return &*next_++;
      build_index();
    }
    const auto found = std::lower_bound(index_.begin(), index_.end(), name,
                                        [](const MessageElement* a, std::string_view b) { return a->name < b; });
    return found != index_.end() && (*found)->name == name ? *found : nullptr;
  }

 private:
  static bool is_named(const MessageElement& element, std::string_view name) {
    return element.key_kind == KeyKind::name && element.name == name;
  }

  void build_index() {
    is_indexed_ = true;
    for (const auto& child : children_)
      if (child.key_kind == KeyKind::name) index_.push_back(&child);
    // Equal names stay in wire order, which is address order: a stable_sort is three times the code.
    rr::sort(index_, [](const MessageElement* a, const MessageElement* b) {
      return a->name != b->name ? a->name < b->name : std::less<>()(a, b);
    });
  }

  const ElementRange& children_;
  ElementRange::iterator next_;
  bool is_indexed_ = false;
  std::vector<const MessageElement*> index_;
};

DataType element_type(EntityKind kind, bool is_multidim_element) {
  if (kind == EntityKind::structure) return DataType::structure_t;
  if (kind == EntityKind::pod) return is_multidim_element ? DataType::pod_multidimarray_t : DataType::pod_array_t;
  return is_multidim_element ? DataType::namedarray_multidimarray_t : DataType::namedarray_array_t;
}

}  // namespace

bool Unpacker::unpack_named(const FieldPath& path, const MessageElement& element, const TypeDefinition& type,
                            Place place, Value& out) {
  const std::string_view type_name = type.qualified_name;
  const auto* entity = types_.find_entity(type_name);
  if (!entity || entity->kind == EntityKind::object)
    return fail(ErrorCode::data_type_error, path, quote(type_name) + (entity ? " is an object" : " is not known"));
  if (element.type == DataType::void_t) {
    if (entity->kind == EntityKind::structure) return true;
    const auto code = type.array == ArrayKind::none ? ErrorCode::data_type_error : ErrorCode::null_value;
    return fail(code, path, "is null, expected " + item_type_text(type));
  }
  const auto wire_type = element_type(entity->kind, is_multidim(type) && place == Place::anywhere);
  if (element.type != wire_type) return fail_mismatch(path, element, item_type_text(type));

  if (entity->kind == EntityKind::structure) return unpack_structure(path, element, *entity, type_name, out);
  if (entity->kind == EntityKind::pod) {
    PodArray pods;
    if (!unpack_pods(path, element, *entity, type_name, pods) || !set_shape(path, pods, pods.items.size(), type, place))
      return false;
    out = std::move(pods);
  } else {
    NamedArray named;
    if (!unpack_named_arrays(path, element, *entity, type_name, named) ||
        !set_shape(path, named, named.array.size() / entity->namedarray_count, type, place))
      return false;
    out = std::move(named);
  }
  return true;
}

bool Unpacker::unpack_named_varvalue(const FieldPath& path, const MessageElement& element, Value& out) {
  if (element.type == DataType::pod_t) return fail_mismatch(path, element, "a value; a pod stands only in a pod array");
  const auto* entity = types_.find_entity(element.type_name);
  if (!entity) return fail(ErrorCode::data_type_error, path, "type " + quote(element.type_name) + " is not known");
  const std::string_view type_name = element.type_name;
  const bool is_multidim_element =
      element.type == DataType::pod_multidimarray_t || element.type == DataType::namedarray_multidimarray_t;
  if (entity->kind == EntityKind::object || element.type != element_type(entity->kind, is_multidim_element))
    return fail_mismatch(path, element, "the kind of type that " + quote(type_name) + " is");

  if (entity->kind == EntityKind::structure) return unpack_structure(path, element, *entity, type_name, out);
  if (entity->kind == EntityKind::pod) {
    PodArray pods;
    if (!unpack_pods(path, element, *entity, type_name, pods)) return false;
    out = std::move(pods);
  } else {
    NamedArray named;
    if (!unpack_named_arrays(path, element, *entity, type_name, named)) return false;
    out = std::move(named);
  }
  return true;
}

bool Unpacker::unpack_structure(const FieldPath& path, const MessageElement& element, const EntityDefinition& entity,
                                std::string_view type_name, Value& out) {
  Structure structure;
  if (!check_element(path, element, DataType::structure_t, type_name)) return false;
  if (!unpack_fields(path, element, entity, type_name, Place::anywhere, structure)) return false;
  structure.type_name = type_name;
  out = std::move(structure);
  return true;
}

bool Unpacker::unpack_fields(const FieldPath& path, const MessageElement& element, const EntityDefinition& entity,
                             std::string_view type_name, Place place, Structure& out) {
  const auto children = message_.children_of(element);
  FieldFinder finder(children);
  // A definition may name more fields than the message has: then one is missing, and nothing was reserved for them.
  out.fields.reserve(std::min<std::size_t>(entity.members.size(), children.size()));
  for (const auto& member : entity.members) {
    const auto at = path.field(member.name, type_name);
    const auto* child = finder.find(member.name);
    if (!child)
      return fail(ErrorCode::message_element_not_found, at, "is missing, expected " + format_type(member.type));
    out.fields.push_back({member.name, {}});
    if (!unpack_value(at, *child, member.type, place, out.fields.back().value)) return false;
  }
  return true;
}

bool Unpacker::unpack_pods(const FieldPath& path, const MessageElement& element, const EntityDefinition& entity,
                           std::string_view type_name, PodArray& out) {
  out.type_name = type_name;
  if (element.type != DataType::pod_multidimarray_t) return unpack_pod_items(path, element, entity, type_name, out);
  out.is_multidim = true;
  if (!check_element(path, element, DataType::pod_multidimarray_t, type_name)) return false;
  const auto* array = unpack_dims(path, element, out.dims);
  return array && unpack_pod_items(path, *array, entity, type_name, out) &&
         check_dims(path, out.dims, out.items.size());
}

bool Unpacker::unpack_pod_items(const FieldPath& path, const MessageElement& element, const EntityDefinition& entity,
                                std::string_view type_name, PodArray& out) {
  if (!check_element(path, element, DataType::pod_array_t, type_name)) return false;
  const auto children = message_.children_of(element);
  out.items.reserve(children.size());
  std::int32_t position = 0;
  for (const auto& child : children) {
    const auto at = path.index(position);
    if (!check_position(at, child, position++)) return false;
    if (child.type != DataType::pod_t) return fail_mismatch(at, child, "pod");
    if (!unpack_fields(at, child, entity, type_name, Place::in_pod, out.items.emplace_back())) return false;
  }
  return true;
}

bool Unpacker::unpack_named_arrays(const FieldPath& path, const MessageElement& element, const EntityDefinition& entity,
                                   std::string_view type_name, NamedArray& out) {
  out.type_name = type_name;
  if (element.type != DataType::namedarray_multidimarray_t)
    return unpack_named_numbers(path, element, entity, type_name, out);
  out.is_multidim = true;
  if (!check_element(path, element, DataType::namedarray_multidimarray_t, type_name)) return false;
  const auto* array = unpack_dims(path, element, out.dims);
  return array && unpack_named_numbers(path, *array, entity, type_name, out) &&
         check_dims(path, out.dims, out.array.size() / entity.namedarray_count);
}

bool Unpacker::unpack_named_numbers(const FieldPath& path, const MessageElement& element,
                                    const EntityDefinition& entity, std::string_view type_name, NamedArray& out) {
  if (!check_element(path, element, DataType::namedarray_array_t, type_name)) return false;
  const auto* array = find_child(path, element, "array");
  if (!array || !unpack_array(path.field("array", {}), *array, entity.namedarray_type, out.array)) return false;
  const auto each = entity.namedarray_count;
  if (each != 0 && out.array.size() % each == 0) return true;
  return fail(ErrorCode::data_type_error, path,
              "has " + std::to_string(out.array.size()) + " numbers, expected a multiple of " + std::to_string(each));
}

template <class Named>
bool Unpacker::set_shape(const FieldPath& path, Named& value, std::size_t count, const TypeDefinition& type,
                         Place place) {
  value.is_scalar = type.array == ArrayKind::none;
  if (is_multidim(type) && place == Place::anywhere) {
    if (has_declared_dims(type, value.dims)) return true;
    return fail(ErrorCode::data_type_error, path,
                "has dims " + dims_text(value.dims) + ", expected " + item_type_text(type));
  }
  const auto wrong =
      value.is_scalar && count != 1 ? "has " + std::to_string(count) + ", expected 1" : wrong_count(type, count);
  if (!wrong.empty()) return fail(ErrorCode::data_type_error, path, wrong + " (" + item_type_text(type) + ")");
  if (is_multidim(type)) {
    value.is_multidim = true;
    value.dims.assign(type.sizes.begin(), type.sizes.end());
  }
  return true;
}

bool Unpacker::check_element(const FieldPath& path, const MessageElement& element, DataType type,
                             std::string_view type_name) {
  if (element.type != type) return fail_mismatch(path, element, data_type_name(type));
  if (element.type_name == type_name) return true;
  return fail(ErrorCode::data_type_error, path,
              "found type " + quote(element.type_name) + ", expected " + std::string(type_name));
}

}  // namespace rr
