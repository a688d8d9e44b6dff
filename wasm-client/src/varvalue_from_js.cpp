// Varvalues: values that bring their type along, or show it. Layer: wasm-client/src.
#include <algorithm>
#include <cmath>

#include "core/types/type_text.hpp"
#include "wasm-client/src/value_from_js.hpp"

namespace rr {

namespace {

bool is_int32(double number) {
  return number >= -2147483648.0 && number <= 2147483647.0 && std::trunc(number) == number &&
         !(number == 0 && std::signbit(number));
}

}  // namespace

bool FromJs::infer(const FieldPath& path, const JsValue& js, Value& out) {
  const Level level(depth_);
  if (depth_ > max_depth) return fail(ErrorCode::data_type_error, path, "is nested too deeply, or holds itself");
  switch (js.kind()) {
    case JsKind::undefined:
    case JsKind::null:
      return true;
    case JsKind::boolean:
      out = js.is_true();
      return true;
    case JsKind::number:
    case JsKind::bigint:
      return infer_number(path, js, out);
    case JsKind::text: {
      std::string text;
      if (!read_text(path, js, text)) return false;
      out = std::move(text);
      return true;
    }
    case JsKind::items: {
      Array array;
      if (!read_array(path, js, js.items_type(), array)) return false;
      out = std::move(array);
      return true;
    }
    case JsKind::array:
    case JsKind::object:
    case JsKind::exact:
      break;
    case JsKind::map: {
      const auto items = js.map_items();
      if (!items) return fail_throwing(path);
      const auto first = items->at(0);
      TypeDefinition type;
      type.type = DataType::varvalue_t;
      const bool has_numbers = first && first->kind() == JsKind::number;
      type.container = has_numbers ? ContainerKind::map_int32 : ContainerKind::map_string;
      return read(path, js, type, out);
    }
    case JsKind::other:
      return fail_mismatch(path, js, "a value");
  }

  std::optional<std::string> type_text;
  auto value = js;
  if (js.kind() == JsKind::exact) {
    std::optional<JsValue> given_type;
    std::optional<JsValue> given_value;
    if (!field_of(path, js, "type", given_type) || !field_of(path, js, "value", given_value)) return false;
    if (given_type->kind() != JsKind::text)
      return fail_mismatch(path, *given_type, "the type of rrValue() as a string");
    type_text = given_type->text();
    if (!type_text) type_text = "";
    value = std::move(*given_value);
  } else {
    type_text = js.type_mark();
  }
  if (type_text) {
    const auto type = parse_type_text(*type_text, types_);
    if (type.has_error()) return fail(type.error().code, path, "rrValue: " + type.error().message);
    return read(path, value, *type, out);
  }
  return js.kind() == JsKind::array ? infer_array(path, js, out) : infer_object(path, js, out);
}

/// int32 where it fits, else double; bigints: int64, else uint64.
bool FromJs::infer_number(const FieldPath& path, const JsValue& js, Value& out) {
  if (js.kind() == JsKind::number) {
    const double number = js.number();
    if (is_int32(number))
      out = static_cast<std::int32_t>(number);
    else
      out = number;
    return true;
  }
  if (const auto number = js.int64())
    out = *number;
  else if (const auto large = js.uint64())
    out = *large;
  else
    return fail(ErrorCode::out_of_range, path, "a bigint of more than 64 bits fits no type");
  return true;
}

/// Numbers alone make int32[] (where all fit) or double[], booleans alone bool[], everything else a list.
bool FromJs::infer_array(const FieldPath& path, const JsValue& js, Value& out) {
  std::size_t count = 0;
  if (!read_length(path, js, count)) return false;
  if (count > 0) {
    std::vector<double> numbers(count);
    const int stop = js.read_numbers(numbers.data(), count);
    if (stop == -2) return fail_throwing(path);
    if (stop == -1) {
      if (!std::all_of(numbers.begin(), numbers.end(), is_int32)) {
        out = std::move(numbers);
        return true;
      }
      std::vector<std::int32_t> integers(count);
      std::transform(numbers.begin(), numbers.end(), integers.begin(),
                     [](double number) { return static_cast<std::int32_t>(number); });
      out = std::move(integers);
      return true;
    }
    Bytes booleans(count);
    if (js.read_booleans(booleans.data(), count) == -1) {
      out = Array::copy(DataType::bool_t, booleans);
      return true;
    }
  }
  TypeDefinition list;
  list.type = DataType::varvalue_t;
  list.container = ContainerKind::list;
  return read(path, js, list, out);
}

/// {re, im} is complex, {dims, data} multi-dimensional, every other object a map with string keys.
bool FromJs::infer_object(const FieldPath& path, const JsValue& js, Value& out) {
  const auto keys = js.keys();
  if (!keys) return fail_throwing(path);
  const auto has_only = [&](std::string_view first, std::string_view second) {
    std::size_t found = 0;
    const auto count = keys->length().value_or(0);
    for (std::size_t i = 0; count == 2 && i < 2; ++i) {
      const auto key = keys->at(i)->text();
      if (key == first || key == second) ++found;
    }
    return found == 2;
  };
  TypeDefinition type;
  if (has_only("re", "im")) {
    std::optional<JsValue> real;
    if (!field_of(path, js, "re", real)) return false;
    type.type = DataType::cdouble_t;
    if (real->kind() == JsKind::items && real->items_type() == DataType::single_t) type.type = DataType::csingle_t;
    if (real->kind() != JsKind::number) type.array = ArrayKind::variable;
    return read(path, js, type, out);
  }
  if (has_only("dims", "data")) {
    std::optional<JsValue> data;
    Value items;
    if (!field_of(path, js, "data", data)) return false;
    const auto at = path.field("data", {});
    if (!infer(at, *data, items)) return false;
    const auto* array = items.get_if<Array>();
    if (!array) return fail_mismatch(at, *data, "numbers");
    MultiDimArray value;
    auto unused = JsValue::undefined();
    if (!read_shape(path, js, value.dims, unused)) return false;
    value.array = *array;
    out = std::move(value);
    return true;
  }
  type.type = DataType::varvalue_t;
  type.container = ContainerKind::map_string;
  return read(path, js, type, out);
}

}  // namespace rr
