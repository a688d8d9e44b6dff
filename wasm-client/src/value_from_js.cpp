#include "wasm-client/src/value_from_js.hpp"

#include <cmath>

#include "core/support/whole_number.hpp"
#include "core/types/multidim.hpp"
#include "core/types/number.hpp"

namespace rr {

Result<Value> from_js(const JsValue& js, const TypeDefinition& type, const TypeRegistry& types, const FieldPath& path) {
  FromJs reader(types);
  Value value;
  if (!reader.read(path, js, type, value)) return reader.take_error();
  return value;
}

bool FromJs::read(const FieldPath& path, const JsValue& js, const TypeDefinition& type, Value& out) {
  const Level level(depth_);
  if (depth_ > max_depth) return fail(ErrorCode::data_type_error, path, "is nested too deeply, or holds itself");
  const auto read_one = [&](const FieldPath& at, const JsValue& item, Value& to) {
    return read_item(at, item, type, to);
  };
  switch (type.container) {
    case ContainerKind::list:
      return read_list(path, js, out, read_one);
    case ContainerKind::map_int32:
      return read_map_int32(path, js, out, read_one);
    case ContainerKind::map_string:
      return read_map_string(path, js, out, read_one);
    case ContainerKind::none:
    case ContainerKind::generator:
      break;
  }
  return read_item(path, js, type, out);
}

bool FromJs::read_item(const FieldPath& path, const JsValue& js, const TypeDefinition& type, Value& out) {
  switch (type.type) {
    case DataType::varvalue_t:
      return infer(path, js, out);
    case DataType::enum_t:
      return read_enum(path, js, type, out);
    case DataType::string_t: {
      std::string text;
      if (!read_text(path, js, text)) return false;
      out = std::move(text);
      return true;
    }
    case DataType::structure_t:
    case DataType::pod_t:
    case DataType::namedarray_t:
      return read_named(path, js, type, out);
    default:
      break;
  }
  if (!is_numeric(type.type))
    return fail(ErrorCode::data_type_error, path, item_type_text(type) + " is not the type of a value");
  if (type.array == ArrayKind::none) {
    Scalar scalar;
    if (!read_scalar(path, js, type.type, scalar)) return false;
    out = scalar;
    return true;
  }
  if (is_multidim(type)) {
    MultiDimArray value;
    auto data = JsValue::undefined();
    if (!read_shape(path, js, value.dims, data) || !read_array(path.field("data", {}), data, type.type, value.array))
      return false;
    out = std::move(value);
    return true;
  }
  Array array;
  if (!read_array(path, js, type.type, array)) return false;
  out = std::move(array);
  return true;
}

bool FromJs::read_scalar(const FieldPath& path, const JsValue& js, DataType type, Scalar& out) {
  const std::string expected(data_type_name(type));
  const auto kind = js.kind();
  Scalar found;
  if (type == DataType::bool_t) {
    if (kind != JsKind::boolean) return fail_mismatch(path, js, "a boolean");
    out = Scalar::of(js.is_true());
    return true;
  }
  if (type == DataType::cdouble_t || type == DataType::csingle_t) {
    if (kind != JsKind::object) return fail_mismatch(path, js, expected + " as {re, im}");
    const auto part_type = type == DataType::cdouble_t ? DataType::double_t : DataType::single_t;
    Scalar parts[2];
    for (const int part : {0, 1}) {
      const std::string_view name = part == 0 ? "re" : "im";
      std::optional<JsValue> field;
      if (!field_of(path, js, name, field) || !read_scalar(path.field(name, {}), *field, part_type, parts[part]))
        return false;
    }
    out.type = type;
    std::memcpy(out.storage.data(), parts[0].storage.data(), item_size(part_type));
    std::memcpy(out.storage.data() + item_size(part_type), parts[1].storage.data(), item_size(part_type));
    return true;
  }
  if (kind == JsKind::number) {
    found = Scalar::of(js.number());
    const bool is_wide = type == DataType::int64_t || type == DataType::uint64_t;
    if (is_wide && std::abs(js.number()) > 9007199254740991.0)
      return fail(ErrorCode::out_of_range, path,
                  number_text(found) + " is beyond the safe integers; give a bigint for " + expected);
  } else if (kind == JsKind::bigint) {
    if (const auto number = js.int64())
      found = Scalar::of(*number);
    else if (const auto large = js.uint64())
      found = Scalar::of(*large);
    else
      return fail(ErrorCode::out_of_range, path, "a bigint of more than 64 bits does not fit " + expected);
  } else {
    return fail_mismatch(path, js, expected);
  }
  switch (convert_number(found, type, out)) {
    case Conversion::ok:
      return true;
    case Conversion::wrong_kind:
      return fail(ErrorCode::data_type_mismatch, path, number_text(found) + " is no " + expected);
    case Conversion::out_of_range:
      break;
  }
  return fail(ErrorCode::out_of_range, path, number_text(found) + " does not fit " + expected);
}

bool FromJs::read_enum(const FieldPath& path, const JsValue& js, const TypeDefinition& type, Value& out) {
  if (js.kind() == JsKind::text) {
    std::string name;
    if (!read_text(path, js, name)) return false;
    if (const auto* definition = types_.find_enum(type.qualified_name))
      for (const auto& value : definition->values)
        if (value.name == name) {
          out = value.value;
          return true;
        }
    return fail(ErrorCode::data_type_mismatch, path, quote(name) + " is no value of " + type.qualified_name);
  }
  Scalar scalar;
  if (!read_scalar(path, js, DataType::int32_t, scalar)) return false;
  out = scalar;
  return true;
}

bool FromJs::read_text(const FieldPath& path, const JsValue& js, std::string& out) {
  if (js.kind() != JsKind::text) return fail_mismatch(path, js, "a string");
  auto text = js.text();
  if (!text) return fail(ErrorCode::data_type_error, path, "holds a surrogate without its other half");
  out = std::move(*text);
  return true;
}

template <class ReadOne>
bool FromJs::read_list(const FieldPath& path, const JsValue& js, Value& out, ReadOne read_one) {
  if (js.is_nullish()) return true;
  const auto kind = js.kind();
  if (kind != JsKind::array && kind != JsKind::items) return fail_mismatch(path, js, "an array or null");
  std::size_t count = 0;
  if (!read_length(path, js, count)) return false;
  List list;
  list.items.reserve(count);
  for (std::size_t i = 0; i < count; ++i) {
    std::optional<JsValue> item;
    const auto at = path.index(static_cast<std::int32_t>(i));
    if (!item_at(at, js, i, item) || !read_one(at, *item, list.items.emplace_back())) return false;
  }
  out = std::move(list);
  return true;
}

/// A Map, or an object: the pairs of key and value.
bool FromJs::read_map_items(const FieldPath& path, const JsValue& js, std::vector<std::pair<JsValue, JsValue>>& out) {
  const bool is_map = js.kind() == JsKind::map;
  if (!is_map && js.kind() != JsKind::object) return fail_mismatch(path, js, "a Map, an object or null");
  const auto keys = is_map ? js.map_items() : js.keys();
  if (!keys) return fail_throwing(path);
  std::size_t count = 0;
  if (!read_length(path, *keys, count)) return false;
  out.reserve(count);
  for (std::size_t i = 0; i < count; i += is_map ? 2 : 1) {
    auto key = keys->at(i);
    std::optional<JsValue> item;
    if (is_map) {
      item = keys->at(i + 1);
    } else {
      const auto name = key->text();
      if (!name) return fail(ErrorCode::data_type_error, path, "has a key that holds half of a surrogate pair");
      if (!field_of(path.key(*name), js, *name, item)) return false;
    }
    out.emplace_back(std::move(*key), std::move(*item));
  }
  return true;
}

template <class ReadOne>
bool FromJs::read_map_int32(const FieldPath& path, const JsValue& js, Value& out, ReadOne read_one) {
  if (js.is_nullish()) return true;
  std::vector<std::pair<JsValue, JsValue>> items;
  if (!read_map_items(path, js, items)) return false;
  MapInt32 map;
  map.items.reserve(items.size());
  for (const auto& [key, item] : items) {
    std::int32_t number = 0;
    if (key.kind() == JsKind::text) {  // the keys of an object are text
      std::string text;
      if (!read_text(path, key, text)) return false;
      const auto said = canonical_number<std::int32_t>(text);
      if (!said) return fail(ErrorCode::data_type_mismatch, path, "has the key " + quote(text) + ", expected an int32");
      number = *said;
    } else {
      Scalar scalar;
      if (!read_scalar(path, key, DataType::int32_t, scalar)) return false;
      number = load<std::int32_t>(scalar.storage.data());
    }
    auto& [to_key, to] = map.items.emplace_back();
    to_key = number;
    if (!read_one(path.index(number), item, to)) return false;
  }
  out = std::move(map);
  return true;
}

template <class ReadOne>
bool FromJs::read_map_string(const FieldPath& path, const JsValue& js, Value& out, ReadOne read_one) {
  if (js.is_nullish()) return true;
  std::vector<std::pair<JsValue, JsValue>> items;
  if (!read_map_items(path, js, items)) return false;
  MapString map;
  map.items.reserve(items.size());
  for (const auto& [key, item] : items) {
    auto& [to_key, to] = map.items.emplace_back();
    if (key.kind() != JsKind::text) return fail_mismatch(path, key, "a string as key");
    if (!read_text(path, key, to_key)) return false;
    const auto at = path.key(to_key);
    if (!read_one(at, item, to)) return false;
  }
  out = std::move(map);
  return true;
}

bool FromJs::item_at(const FieldPath& path, const JsValue& js, std::size_t index, std::optional<JsValue>& out) {
  out = js.at(index);
  return out || fail_throwing(path);
}

bool FromJs::field_of(const FieldPath& path, const JsValue& js, std::string_view name, std::optional<JsValue>& out) {
  out = js.field(name);
  return out || fail_throwing(path);
}

bool FromJs::fail(ErrorCode code, const FieldPath& path, std::string_view text) {
  error_ = value_error(code, "convert", path, text);
  return false;
}

bool FromJs::fail_mismatch(const FieldPath& path, const JsValue& found, std::string_view expected) {
  const auto code = found.is_nullish() ? ErrorCode::null_value : ErrorCode::data_type_mismatch;
  return fail(code, path, "found " + std::string(found.kind_text()) + ", expected " + std::string(expected));
}

bool FromJs::fail_throwing(const FieldPath& path) {
  return fail(ErrorCode::invalid_argument, path, "could not be read: its getter or Proxy threw");
}

}  // namespace rr
