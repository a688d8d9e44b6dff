// Arrays of numbers from TypedArrays, arrays and {dims, data}. Layer: wasm-client/src.
#include "core/types/number.hpp"
#include "wasm-client/src/value_from_js.hpp"

namespace rr {

namespace {

std::string array_text(DataType type) {
  return std::string(data_type_name(type)) + "[]";
}

}  // namespace

bool FromJs::read_array(const FieldPath& path, const JsValue& js, DataType type, Array& out) {
  if (type == DataType::cdouble_t || type == DataType::csingle_t) return read_complex(path, js, type, out);
  const auto kind = js.kind();
  if (kind != JsKind::array && kind != JsKind::items) return fail_mismatch(path, js, array_text(type));
  std::size_t count = 0;
  if (!read_length(path, js, count)) return false;
  switch (type) {
    case DataType::double_t:
      return read_numbers<double>(path, js, count, out);
    case DataType::single_t:
      return read_numbers<float>(path, js, count, out);
    case DataType::int8_t:
      return read_numbers<std::int8_t>(path, js, count, out);
    case DataType::uint8_t:
      return read_numbers<std::uint8_t>(path, js, count, out);
    case DataType::int16_t:
      return read_numbers<std::int16_t>(path, js, count, out);
    case DataType::uint16_t:
      return read_numbers<std::uint16_t>(path, js, count, out);
    case DataType::int32_t:
      return read_numbers<std::int32_t>(path, js, count, out);
    case DataType::uint32_t:
      return read_numbers<std::uint32_t>(path, js, count, out);
    case DataType::int64_t:
      return read_numbers<std::int64_t>(path, js, count, out);
    case DataType::uint64_t:
      return read_numbers<std::uint64_t>(path, js, count, out);
    case DataType::bool_t:
      return read_booleans(path, js, count, out);
    default:
      return fail(ErrorCode::data_type_error, path, array_text(type) + " is not the type of a value");
  }
}

template <class T>
bool FromJs::read_numbers(const FieldPath& path, const JsValue& js, std::size_t count, Array& out) {
  constexpr auto type = data_type_of<T>();
  std::vector<T> items(count);
  if (js.kind() == JsKind::items && js.items_type() == type) {
    js.copy_items(items.data());
    out = Array::take(std::move(items));
    return true;
  }
  std::vector<double> numbers(count);
  const int stop = js.read_numbers(numbers.data(), count);
  if (stop == -2) return fail_throwing(path);
  // Bigints, and what is no number, are read (and refused) one by one.
  const std::size_t known = stop < 0 ? count : static_cast<std::size_t>(stop);
  for (std::size_t i = 0; i < count; ++i) {
    constexpr bool is_wide = std::is_integral_v<T> && sizeof(T) == 8;
    Scalar scalar;
    if (!is_wide && i < known && convert_number(Scalar::of(numbers[i]), type, scalar) == Conversion::ok) {
      items[i] = load<T>(scalar.storage.data());
      continue;
    }
    const auto at = path.index(static_cast<std::int32_t>(i));
    std::optional<JsValue> item;
    if (!item_at(at, js, i, item) || !read_scalar(at, *item, type, scalar)) return false;
    items[i] = load<T>(scalar.storage.data());
  }
  out = Array::take(std::move(items));
  return true;
}

bool FromJs::read_booleans(const FieldPath& path, const JsValue& js, std::size_t count, Array& out) {
  Bytes bytes(count);
  if (js.kind() == JsKind::items) {
    if (js.items_type() != DataType::uint8_t) return fail_mismatch(path, js, "booleans, or a Uint8Array of 0 and 1");
    js.copy_items(bytes.data());
    for (std::size_t i = 0; i < count; ++i)
      if (bytes[i] > 1)
        return fail(ErrorCode::out_of_range, path.index(static_cast<std::int32_t>(i)),
                    std::to_string(bytes[i]) + " is no bool, expected 0 or 1");
  } else {
    const int stop = js.read_booleans(bytes.data(), count);
    if (stop == -2) return fail_throwing(path);
    if (stop >= 0) {
      const auto at = path.index(stop);
      std::optional<JsValue> item;
      return item_at(at, js, static_cast<std::size_t>(stop), item) && fail_mismatch(at, *item, "a boolean");
    }
  }
  out = Array::copy(DataType::bool_t, bytes);
  return true;
}

/// {re: numbers, im: numbers}, or an array of {re, im}.
bool FromJs::read_complex(const FieldPath& path, const JsValue& js, DataType type, Array& out) {
  const auto part_type = type == DataType::cdouble_t ? DataType::double_t : DataType::single_t;
  const std::size_t part_size = item_size(part_type);
  Bytes bytes;
  if (js.kind() == JsKind::object) {
    Array parts[2];
    for (const int part : {0, 1}) {
      const std::string_view name = part == 0 ? "re" : "im";
      std::optional<JsValue> field;
      if (!field_of(path, js, name, field) || !read_array(path.field(name, {}), *field, part_type, parts[part]))
        return false;
    }
    const std::size_t count = parts[0].size();
    if (count != parts[1].size())
      return fail(ErrorCode::data_type_error, path,
                  "has " + std::to_string(count) + " real and " + std::to_string(parts[1].size()) + " imaginary parts");
    bytes.resize(2 * count * part_size);
    for (std::size_t i = 0; i < 2 * count; ++i)
      std::memcpy(bytes.data() + i * part_size, parts[i % 2].bytes().data() + i / 2 * part_size, part_size);
  } else if (js.kind() == JsKind::array) {
    std::size_t count = 0;
    if (!read_length(path, js, count)) return false;
    bytes.reserve(2 * count * part_size);
    for (std::size_t i = 0; i < count; ++i) {
      const auto at = path.index(static_cast<std::int32_t>(i));
      std::optional<JsValue> item;
      Scalar scalar;
      if (!item_at(at, js, i, item) || !read_scalar(at, *item, type, scalar)) return false;
      bytes.insert(bytes.end(), scalar.bytes().begin(), scalar.bytes().end());
    }
  } else {
    return fail_mismatch(path, js, array_text(type) + " as {re, im} of arrays");
  }
  out = Array::copy(type, bytes);
  return true;
}

bool FromJs::read_shape(const FieldPath& path, const JsValue& js, std::vector<std::uint32_t>& dims, JsValue& data) {
  if (js.kind() != JsKind::object) return fail_mismatch(path, js, "{dims, data}, column-major");
  std::optional<JsValue> found_dims;
  std::optional<JsValue> found_data;
  if (!field_of(path, js, "dims", found_dims) || !field_of(path, js, "data", found_data)) return false;
  Array array;
  if (!read_array(path.field("dims", {}), *found_dims, DataType::uint32_t, array)) return false;
  const auto items = array.items<std::uint32_t>();
  dims.assign(items.begin(), items.end());
  data = std::move(*found_data);
  return true;
}

bool FromJs::read_length(const FieldPath& path, const JsValue& js, std::size_t& out) {
  const auto length = js.length();
  if (!length) return fail_throwing(path);
  if (*length > max_items)
    return fail(ErrorCode::out_of_range, path,
                "has " + std::to_string(*length) + " items, the limit is " + std::to_string(max_items));
  out = *length;
  return true;
}

}  // namespace rr
