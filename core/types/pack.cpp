// Packing of numbers, strings, arrays and containers; named types are in pack_named.cpp.
#include "core/types/pack.hpp"

#include "core/support/sort.hpp"
#include "core/types/multidim.hpp"
#include "core/types/number.hpp"
#include "core/types/packer.hpp"
#include "core/wire/codec.hpp"

namespace rr {

namespace {

constexpr std::size_t max_depth = DecodeOptions{}.max_depth;  // what our own decoder accepts

FieldPath root_path(const ElementKey& key) {
  if (key.is_number) return {nullptr, FieldPath::Step::index, key.number, {}, {}};
  return {nullptr, FieldPath::Step::field, 0, key.name, {}};
}

ByteSpan dims_bytes(const std::vector<std::uint32_t>& dims) {
  return {reinterpret_cast<const std::uint8_t*>(dims.data()), dims.size() * sizeof(std::uint32_t)};
}

FieldPath step_to(const FieldPath& path, std::int32_t key) {
  return path.index(key);
}
FieldPath step_to(const FieldPath& path, const std::string& key) {
  return path.key(key);
}

}  // namespace

Result<> pack(Message& message, ElementKey key, const Value& value, const TypeDefinition& type,
              const TypeRegistry& types) {
  Packer packer(message, types);
  if (!packer.pack(root_path(key), value, type)) return packer.take_error();
  return {};
}

Result<> pack_varvalue(Message& message, ElementKey key, const Value& value, const TypeRegistry& types) {
  Packer packer(message, types);
  if (!packer.pack_varvalue(root_path(key), value)) return packer.take_error();
  return {};
}

bool Packer::pack_value(const FieldPath& path, const Value& value, const TypeDefinition& type, Place place) {
  const auto pack_one = [&](const FieldPath& at, const Value& item) { return pack_item(at, item, type, place); };
  switch (type.container) {
    case ContainerKind::list:
      return pack_list(path, value, pack_one);
    case ContainerKind::map_int32:
      return pack_map<MapInt32>(path, value, DataType::map_int32_t, pack_one);
    case ContainerKind::map_string:
      return pack_map<MapString>(path, value, DataType::map_string_t, pack_one);
    case ContainerKind::none:
    case ContainerKind::generator:
      break;  // a generator carries one item at a time
  }
  return pack_item(path, value, type, place);
}

bool Packer::pack_varvalue(const FieldPath& path, const Value& value) {
  const auto pack_one = [this](const FieldPath& at, const Value& item) { return pack_varvalue(at, item); };
  if (value.is_null()) return add_leaf(path, DataType::void_t, 0, {});
  if (const auto* scalar = value.get_if<Scalar>()) {
    if (!is_numeric(scalar->type)) return fail(ErrorCode::data_type_error, path, "number without a number type");
    return add_leaf(path, scalar->type, 1, scalar->bytes());
  }
  if (const auto* text = value.get_if<std::string>()) return pack_text(path, *text);
  if (const auto* array = value.get_if<Array>()) return pack_array(path, *array);
  if (const auto* multidim = value.get_if<MultiDimArray>())
    return pack_multidim(path, *multidim, multidim->array.type());
  if (value.get_if<List>()) return pack_list(path, value, pack_one);
  if (value.get_if<MapInt32>()) return pack_map<MapInt32>(path, value, DataType::map_int32_t, pack_one);
  if (value.get_if<MapString>()) return pack_map<MapString>(path, value, DataType::map_string_t, pack_one);
  if (const auto* structure = value.get_if<Structure>()) return pack_named_varvalue(path, value, structure->type_name);
  if (const auto* pods = value.get_if<PodArray>()) return pack_named_varvalue(path, value, pods->type_name);
  return pack_named_varvalue(path, value, value.get_if<NamedArray>()->type_name);
}

bool Packer::pack_item(const FieldPath& path, const Value& value, const TypeDefinition& type, Place place) {
  switch (type.type) {
    case DataType::varvalue_t:
      return pack_varvalue(path, value);
    case DataType::enum_t:
      return pack_scalar(path, value, DataType::int32_t);
    case DataType::string_t:
      if (const auto* text = value.get_if<std::string>()) return pack_text(path, *text);
      return fail_mismatch(path, value, "string");
    case DataType::structure_t:
    case DataType::pod_t:
    case DataType::namedarray_t:
      return pack_named(path, value, type, place);
    default:
      break;
  }
  if (!is_numeric(type.type))
    return fail(ErrorCode::data_type_error, path, item_type_text(type) + " is not the type of a value");
  if (type.array == ArrayKind::none) return pack_scalar(path, value, type.type);
  if (is_multidim(type)) return pack_typed_multidim(path, value, type, place);
  return pack_typed_array(path, value, type);
}

bool Packer::pack_scalar(const FieldPath& path, const Value& value, DataType type) {
  const auto* scalar = value.get_if<Scalar>();
  if (!scalar) return fail_mismatch(path, value, data_type_name(type));
  if (scalar->type == type) return add_leaf(path, type, 1, scalar->bytes());
  Scalar converted;
  switch (convert_number(*scalar, type, converted)) {
    case Conversion::ok:
      return add_leaf(path, type, 1, message_.store(converted.bytes()));
    case Conversion::wrong_kind:
      break;
    case Conversion::out_of_range:
      return fail(
          ErrorCode::out_of_range, path,
          value.type_text() + " " + number_text(*scalar) + " does not fit " + std::string(data_type_name(type)));
  }
  return fail(
      ErrorCode::data_type_mismatch, path,
      "found " + value.type_text() + " " + number_text(*scalar) + ", expected " + std::string(data_type_name(type)));
}

bool Packer::pack_text(const FieldPath& path, std::string_view text) {
  return add_leaf(path, DataType::string_t, text.size(), borrow(as_bytes(text)));
}

bool Packer::pack_array(const FieldPath& path, const Array& array) {
  if (!is_numeric(array.type())) return fail(ErrorCode::data_type_error, path, "array without a number type");
  return add_payload(path, array.type(), array);
}

bool Packer::pack_typed_array(const FieldPath& path, const Value& value, const TypeDefinition& type) {
  const auto* array = value.get_if<Array>();
  if (!array || (array->type() != type.type && array->size() != 0))
    return fail_mismatch(path, value, item_type_text(type));
  if (const auto wrong = wrong_count(type, array->size()); !wrong.empty())
    return fail(ErrorCode::data_type_error, path, wrong + " (" + item_type_text(type) + ")");
  return add_payload(path, type.type, *array);
}

bool Packer::pack_multidim(const FieldPath& path, const MultiDimArray& value, DataType type) {
  if (!is_numeric(type)) return fail(ErrorCode::data_type_error, path, "array without a number type");
  return begin_nested(path, DataType::multidimarray_t) && pack_dims(path, value.dims, value.array.size()) &&
         add_payload(path.field("array", {}), type, value.array) && end_nested();
}

bool Packer::pack_typed_multidim(const FieldPath& path, const Value& value, const TypeDefinition& type, Place place) {
  const auto* multidim = value.get_if<MultiDimArray>();
  if (!multidim || (multidim->array.type() != type.type && multidim->array.size() != 0))
    return fail_mismatch(path, value, item_type_text(type));
  if (!has_declared_dims(type, multidim->dims))
    return fail(ErrorCode::data_type_error, path,
                "has dims " + dims_text(multidim->dims) + ", expected " + item_type_text(type));
  if (place == Place::anywhere) return pack_multidim(path, *multidim, type.type);
  if (const auto wrong = wrong_count(type, multidim->array.size()); !wrong.empty())
    return fail(ErrorCode::data_type_error, path, wrong + " (" + item_type_text(type) + ")");
  return add_payload(path, type.type, multidim->array);
}

bool Packer::pack_dims(const FieldPath& path, const std::vector<std::uint32_t>& dims, std::size_t count) {
  const auto product = product_of(std::span<const std::uint32_t>(dims));
  if (!product || *product != count)
    return fail(ErrorCode::data_type_error, path,
                "dims " + dims_text(dims) + " do not match " + std::to_string(count) + " items");
  return add_leaf(path.field("dims", {}), DataType::uint32_t, dims.size(), borrow(dims_bytes(dims)));
}

template <class PackOne>
bool Packer::pack_list(const FieldPath& path, const Value& value, PackOne pack_one) {
  if (value.is_null()) return add_leaf(path, DataType::void_t, 0, {});
  const auto* list = value.get_if<List>();
  if (!list) return fail_mismatch(path, value, "list");
  if (!begin_nested(path, DataType::list_t)) return false;
  std::int32_t position = 0;
  for (const auto& item : list->items)
    if (!pack_one(path.index(position++), item)) return false;
  return end_nested();
}

/// By key. A type of its own: the lambdas of a template would be a sort each.
struct KeyBefore {
  template <class Item>
  bool operator()(const Item* a, const Item* b) const {
    return a->first < b->first;
  }
};

template <class Map, class PackOne>
bool Packer::pack_map(const FieldPath& path, const Value& value, DataType type, PackOne pack_one) {
  if (value.is_null()) return add_leaf(path, DataType::void_t, 0, {});
  const auto* map = value.get_if<Map>();
  if (!map) return fail_mismatch(path, value, type == DataType::map_int32_t ? "map{int32}" : "map{string}");
  if (!begin_nested(path, type)) return false;

  using Item = typename decltype(map->items)::value_type;
  const auto not_ascending = [](const Item& a, const Item& b) { return !(a.first < b.first); };
  if (std::adjacent_find(map->items.begin(), map->items.end(), not_ascending) == map->items.end()) {
    for (const auto& [key, item] : map->items)
      if (!pack_one(step_to(path, key), item)) return false;
    return end_nested();
  }
  std::vector<const Item*> sorted;
  for (const auto& item : map->items) sorted.push_back(&item);
  rr::sort(sorted, KeyBefore());
  for (std::size_t i = 0; i < sorted.size(); ++i) {
    const auto& [key, item] = *sorted[i];
    if (i > 0 && sorted[i - 1]->first == key)
      return fail(ErrorCode::data_type_error, step_to(path, key), "the key is there twice");
    if (!pack_one(step_to(path, key), item)) return false;
  }
  return end_nested();
}

bool Packer::has_room(const FieldPath& key) {
  if (message_.open_depth() < max_depth) return true;
  return fail(ErrorCode::data_type_error, key,
              "nested deeper than " + std::to_string(max_depth) + " levels, the most a message may have");
}

bool Packer::add_leaf(const FieldPath& key, DataType type, std::size_t count, ByteSpan data) {
  if (!has_room(key)) return false;
  if (count > std::numeric_limits<std::uint32_t>::max())
    return fail(ErrorCode::out_of_range, key, std::to_string(count) + " items do not fit a message");
  if (key.is_numbered())
    message_.add_numbered(key.number, type, static_cast<std::uint32_t>(count), data);
  else
    message_.add(key.name, type, static_cast<std::uint32_t>(count), data);
  return true;
}

ByteSpan Packer::borrow(ByteSpan bytes) {
  // The encoder references what is large until it is sent; these bytes have no owner that could be kept alive.
  return bytes.size() < EncodedMessage::gather_threshold ? bytes : message_.store(bytes);
}

bool Packer::add_payload(const FieldPath& key, DataType type, const Array& array) {
  if (array.bytes().size() >= EncodedMessage::gather_threshold) message_.keep_alive(array.owner());
  return add_leaf(key, type, array.size(), array.bytes());
}

bool Packer::begin_nested(const FieldPath& key, DataType type, std::string_view type_name) {
  if (!has_room(key)) return false;
  if (key.is_numbered())
    message_.begin_nested_numbered(key.number, type, type_name);
  else
    message_.begin_nested(key.name, type, type_name);
  return true;
}

bool Packer::end_nested() {
  message_.end_nested();
  return true;
}

bool Packer::fail(ErrorCode code, const FieldPath& path, std::string_view text) {
  error_ = value_error(code, "pack", path, text);
  return false;
}

bool Packer::fail_mismatch(const FieldPath& path, const Value& found, std::string_view expected) {
  if (found.is_null()) return fail(ErrorCode::null_value, path, "is null, expected " + std::string(expected));
  return fail(ErrorCode::data_type_mismatch, path,
              "found " + found.type_text() + ", expected " + std::string(expected));
}

}  // namespace rr
