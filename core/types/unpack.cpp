// Unpacking of numbers, strings, arrays and containers; named types are in unpack_named.cpp.
#include <algorithm>

#include "core/support/sort.hpp"
#include "core/support/whole_number.hpp"
#include "core/types/multidim.hpp"
#include "core/types/pack.hpp"
#include "core/types/unpacker.hpp"

namespace rr {

namespace {

FieldPath root_path(const MessageElement& element) {
  if (element.key_kind == KeyKind::number) return {nullptr, FieldPath::Step::index, element.number, {}, {}};
  return {nullptr, FieldPath::Step::field, 0, element.name, {}};
}

std::string element_text(const MessageElement& element) {
  const std::string name(data_type_name(element.type));
  if (is_numeric(element.type)) return name + "[" + std::to_string(element.count) + "]";
  return element.type_name.empty() ? name : name + " " + quote(element.type_name);
}

FieldPath step_to(const FieldPath& path, std::int32_t key) {
  return path.index(key);
}
FieldPath step_to(const FieldPath& path, const std::string& key) {
  return path.key(key);
}

}  // namespace

Result<Value> unpack(const Message& message, const MessageElement& element, const TypeDefinition& type,
                     const TypeRegistry& types) {
  Unpacker unpacker(message, types);
  Value value;
  if (!unpacker.unpack(root_path(element), element, type, value)) return unpacker.take_error();
  return value;
}

Result<Value> unpack_varvalue(const Message& message, const MessageElement& element, const TypeRegistry& types) {
  Unpacker unpacker(message, types);
  Value value;
  if (!unpacker.unpack_varvalue(root_path(element), element, value)) return unpacker.take_error();
  return value;
}

bool Unpacker::unpack_value(const FieldPath& path, const MessageElement& element, const TypeDefinition& type,
                            Place place, Value& out) {
  const auto unpack_one = [&](const FieldPath& at, const MessageElement& item, Value& to) {
    return unpack_item(at, item, type, place, to);
  };
  switch (type.container) {
    case ContainerKind::list:
      return unpack_list(path, element, out, unpack_one);
    case ContainerKind::map_int32:
      return unpack_map<MapInt32>(path, element, out, unpack_one);
    case ContainerKind::map_string:
      return unpack_map<MapString>(path, element, out, unpack_one);
    case ContainerKind::none:
    case ContainerKind::generator:
      break;  // a generator carries one item at a time
  }
  return unpack_item(path, element, type, place, out);
}

bool Unpacker::unpack_varvalue(const FieldPath& path, const MessageElement& element, Value& out) {
  const auto unpack_one = [this](const FieldPath& at, const MessageElement& item, Value& to) {
    return unpack_varvalue(at, item, to);
  };
  switch (element.type) {
    case DataType::void_t:
      return true;
    case DataType::string_t:
      out = Value(element.text());
      return true;
    case DataType::list_t:
      return unpack_list(path, element, out, unpack_one);
    case DataType::map_int32_t:
      return unpack_map<MapInt32>(path, element, out, unpack_one);
    case DataType::map_string_t:
      return unpack_map<MapString>(path, element, out, unpack_one);
    case DataType::multidimarray_t: {
      const auto* array = find_child(path, element, "array");
      if (!array) return false;
      if (!is_numeric(array->type)) return fail_mismatch(path.field("array", {}), *array, "numbers");
      TypeDefinition type;
      type.type = array->type;
      type.array = ArrayKind::multidim;
      return unpack_multidim(path, element, type, Place::anywhere, out);
    }
    default:
      break;
  }
  if (!is_numeric(element.type)) return unpack_named_varvalue(path, element, out);
  out = Array::copy(element.type, element.data);
  return true;
}

bool Unpacker::unpack_item(const FieldPath& path, const MessageElement& element, const TypeDefinition& type,
                           Place place, Value& out) {
  switch (type.type) {
    case DataType::void_t:
      return true;  // what stands for "no value" differs between peers
    case DataType::varvalue_t:
      return unpack_varvalue(path, element, out);
    case DataType::enum_t:
      return unpack_scalar(path, element, type, out);
    case DataType::string_t:
      if (element.type == DataType::void_t) return fail(ErrorCode::data_type_error, path, "is null, expected string");
      if (element.type != DataType::string_t) return fail_mismatch(path, element, "string");
      out = Value(element.text());
      return true;
    case DataType::structure_t:
    case DataType::pod_t:
    case DataType::namedarray_t:
      return unpack_named(path, element, type, place, out);
    default:
      break;
  }
  if (!is_numeric(type.type))
    return fail(ErrorCode::data_type_error, path, item_type_text(type) + " is not the type of a value");
  if (type.array == ArrayKind::none) return unpack_scalar(path, element, type, out);
  if (is_multidim(type)) return unpack_multidim(path, element, type, place, out);
  if (element.type != type.type) return fail_mismatch(path, element, item_type_text(type));
  if (const auto wrong = wrong_count(type, element.count); !wrong.empty())
    return fail(ErrorCode::data_type_error, path, wrong + " (" + item_type_text(type) + ")");
  out = Array::copy(type.type, element.data);
  return true;
}

bool Unpacker::unpack_scalar(const FieldPath& path, const MessageElement& element, const TypeDefinition& type,
                             Value& out) {
  const auto data_type = type.type == DataType::enum_t ? DataType::int32_t : type.type;
  if (element.type != data_type) return fail_mismatch(path, element, item_type_text(type));
  if (element.count == 0) return fail(ErrorCode::out_of_range, path, "is empty, expected " + item_type_text(type));
  out = Scalar::from_bytes(data_type, element.data);  // surplus items are ignored (rule 9)
  return true;
}

bool Unpacker::unpack_array(const FieldPath& path, const MessageElement& element, DataType type, Array& out) {
  if (element.type != type) return fail_mismatch(path, element, std::string(data_type_name(type)) + "[]");
  out = Array::copy(type, element.data);
  return true;
}

bool Unpacker::unpack_multidim(const FieldPath& path, const MessageElement& element, const TypeDefinition& type,
                               Place place, Value& out) {
  MultiDimArray value;
  if (place == Place::in_pod) {
    if (!unpack_array(path, element, type.type, value.array)) return false;
    if (const auto wrong = wrong_count(type, value.array.size()); !wrong.empty())
      return fail(ErrorCode::data_type_error, path, wrong + " (" + item_type_text(type) + ")");
    value.dims.assign(type.sizes.begin(), type.sizes.end());
  } else {
    if (element.type != DataType::multidimarray_t) return fail_mismatch(path, element, item_type_text(type));
    const auto* array = unpack_dims(path, element, value.dims);
    if (!array || !unpack_array(path.field("array", {}), *array, type.type, value.array) ||
        !check_dims(path, value.dims, value.array.size()))
      return false;
    if (!has_declared_dims(type, value.dims))
      return fail(ErrorCode::data_type_error, path,
                  "has dims " + dims_text(value.dims) + ", expected " + item_type_text(type));
  }
  out = std::move(value);
  return true;
}

const MessageElement* Unpacker::unpack_dims(const FieldPath& path, const MessageElement& element,
                                            std::vector<std::uint32_t>& dims) {
  const auto* found = find_child(path, element, "dims");
  if (!found) return nullptr;
  Array array;
  if (!unpack_array(path.field("dims", {}), *found, DataType::uint32_t, array)) return nullptr;
  const auto items = array.items<std::uint32_t>();
  dims.assign(items.begin(), items.end());
  return find_child(path, element, "array");
}

bool Unpacker::check_dims(const FieldPath& path, std::span<const std::uint32_t> dims, std::size_t count) {
  const auto product = product_of(dims);
  if (product && *product == count) return true;
  return fail(ErrorCode::data_type_error, path,
              "dims " + dims_text(dims) + " do not match " + std::to_string(count) + " items");
}

template <class UnpackOne>
bool Unpacker::unpack_list(const FieldPath& path, const MessageElement& element, Value& out, UnpackOne unpack_one) {
  if (element.type == DataType::void_t) return true;
  if (element.type != DataType::list_t) return fail_mismatch(path, element, "list");
  const auto children = message_.children_of(element);
  List list;
  list.items.reserve(children.size());
  std::int32_t position = 0;
  for (const auto& child : children) {
    const auto at = path.index(position);
    if (!check_position(at, child, position++) || !unpack_one(at, child, list.items.emplace_back())) return false;
  }
  out = std::move(list);
  return true;
}

/// By key. A type of its own: the lambdas of a template would be a sort each.
struct ItemBefore {
  template <class Item>
  bool operator()(const Item& a, const Item& b) const {
    return a.first < b.first;
  }
};

template <class Map, class UnpackOne>
bool Unpacker::unpack_map(const FieldPath& path, const MessageElement& element, Value& out, UnpackOne unpack_one) {
  constexpr auto type = std::is_same_v<Map, MapInt32> ? DataType::map_int32_t : DataType::map_string_t;
  if (element.type == DataType::void_t) return true;
  if (element.type != type) return fail_mismatch(path, element, data_type_name(type));
  const auto children = message_.children_of(element);
  Map map;
  map.items.reserve(children.size());
  for (const auto& child : children) {
    auto& [key, value] = map.items.emplace_back();
    if (!read_key(path, child, key) || !unpack_one(step_to(path, key), child, value)) return false;
  }
  using Item = typename decltype(map.items)::value_type;
  if (!std::is_sorted(map.items.begin(), map.items.end(), ItemBefore())) rr::sort(map.items, ItemBefore());
  const auto twice = std::adjacent_find(map.items.begin(), map.items.end(),
                                        [](const Item& a, const Item& b) { return a.first == b.first; });
  if (twice != map.items.end())
    return fail(ErrorCode::data_type_error, step_to(path, twice->first), "the key is there twice");
  out = std::move(map);
  return true;
}

bool Unpacker::read_key(const FieldPath& path, const MessageElement& element, std::int32_t& key) {
  if (element.key_kind == KeyKind::number) {
    key = element.number;
    return true;
  }
  // Version 2 and older writers of version 4 name the elements by decimal text.
  const auto text = element.name;
  const auto number = whole_number<std::int32_t>(text);
  if (element.key_kind == KeyKind::name && number) {
    key = *number;
    return true;
  }
  return fail(ErrorCode::data_type_error, path, "has the key " + quote(text) + ", expected an int32");
}

bool Unpacker::read_key(const FieldPath& path, const MessageElement& element, std::string& key) {
  if (element.key_kind == KeyKind::name) {
    key = element.name;
    return true;
  }
  return fail(ErrorCode::data_type_error, path, "has an element without a name, expected string keys");
}

bool Unpacker::check_position(const FieldPath& path, const MessageElement& element, std::int32_t position) {
  std::int32_t key = 0;
  if (!read_key(path, element, key)) return false;
  if (key == position) return true;
  return fail(ErrorCode::data_type_error, path,
              "has the key " + std::to_string(key) + ", expected " + std::to_string(position));
}

const MessageElement* Unpacker::find_child(const FieldPath& path, const MessageElement& element,
                                           std::string_view name) {
  const auto* child = message_.children_of(element).find(name);
  if (!child) fail(ErrorCode::message_element_not_found, path.field(name, {}), "is missing");
  return child;
}

bool Unpacker::fail(ErrorCode code, const FieldPath& path, std::string_view text) {
  error_ = value_error(code, "unpack", path, text);
  return false;
}

bool Unpacker::fail_mismatch(const FieldPath& path, const MessageElement& found, std::string_view expected) {
  if (found.type == DataType::void_t)
    return fail(ErrorCode::null_value, path, "is null, expected " + std::string(expected));
  return fail(ErrorCode::data_type_mismatch, path,
              "found " + element_text(found) + ", expected " + std::string(expected));
}

}  // namespace rr
