#include "wasm-client/src/js_access.hpp"

#include <cstdlib>

using emscripten::EM_VAL;

extern "C" {
int rr_js_kind(EM_VAL value);
int rr_js_items_type(EM_VAL value);
double rr_js_number(EM_VAL value);
int rr_js_bigint(EM_VAL value, int is_unsigned, void* to);
char* rr_js_text(EM_VAL value, std::size_t* length);
int rr_js_length(EM_VAL value);
EM_VAL rr_js_item(EM_VAL value, int index);
EM_VAL rr_js_field(EM_VAL value, const char* name, std::size_t length);
EM_VAL rr_js_keys(EM_VAL value);
EM_VAL rr_js_map_items(EM_VAL value);
EM_VAL rr_js_type_mark(EM_VAL value);
void rr_js_copy_items(EM_VAL value, void* to);
int rr_js_read_numbers(EM_VAL value, double* to, std::size_t count);
int rr_js_read_booleans(EM_VAL value, std::uint8_t* to, std::size_t count);

EM_VAL rr_js_make_text(const char* text, std::size_t length);
EM_VAL rr_js_make_number(double value);
EM_VAL rr_js_make_bigint(const void* bytes, int is_unsigned);
EM_VAL rr_js_make_items(int type, const void* bytes, std::size_t length);
EM_VAL rr_js_make_booleans(const void* bytes, std::size_t length);
EM_VAL rr_js_make_parts(int type, const void* bytes, std::size_t count, int part);
EM_VAL rr_js_make_object();
EM_VAL rr_js_make_array();
EM_VAL rr_js_make_map();
EM_VAL rr_js_make_view(const void* bytes, std::size_t length);
void rr_js_set_field(EM_VAL object, const char* name, std::size_t length, EM_VAL value);
void rr_js_push(EM_VAL array, EM_VAL value);
void rr_js_set_key(EM_VAL map, EM_VAL key, EM_VAL value);
void rr_js_mark_type(EM_VAL object, const char* name, std::size_t length);
}

namespace rr {

namespace {

/// Handle 0 stands for "reading failed".
std::optional<JsValue> take(EM_VAL handle) {
  if (!handle) return std::nullopt;
  return JsValue(val::take_ownership(handle));
}

}  // namespace

JsKind JsValue::kind() const {
  return static_cast<JsKind>(rr_js_kind(value_.as_handle()));
}
double JsValue::number() const {
  return rr_js_number(value_.as_handle());
}

std::optional<std::int64_t> JsValue::int64() const {
  std::int64_t number = 0;
  if (!rr_js_bigint(value_.as_handle(), false, &number)) return std::nullopt;
  return number;
}

std::optional<std::uint64_t> JsValue::uint64() const {
  std::uint64_t number = 0;
  if (!rr_js_bigint(value_.as_handle(), true, &number)) return std::nullopt;
  return number;
}

std::optional<std::string> JsValue::text() const {
  std::size_t length = 0;
  char* text = rr_js_text(value_.as_handle(), &length);
  if (!text) return std::nullopt;
  std::string copy(text, length);
  std::free(text);
  return copy;
}

std::optional<std::size_t> JsValue::length() const {
  const int length = rr_js_length(value_.as_handle());
  if (length < 0) return std::nullopt;
  return static_cast<std::size_t>(length);
}

std::optional<JsValue> JsValue::at(std::size_t index) const {
  return take(rr_js_item(value_.as_handle(), static_cast<int>(index)));
}

std::optional<JsValue> JsValue::field(std::string_view name) const {
  return take(rr_js_field(value_.as_handle(), name.data(), name.size()));
}

std::optional<JsValue> JsValue::keys() const {
  return take(rr_js_keys(value_.as_handle()));
}
std::optional<JsValue> JsValue::map_items() const {
  return take(rr_js_map_items(value_.as_handle()));
}

std::optional<std::string> JsValue::type_mark() const {
  const auto mark = take(rr_js_type_mark(value_.as_handle()));
  if (!mark || mark->is_nullish()) return std::nullopt;
  return mark->text();
}

DataType JsValue::items_type() const {
  return static_cast<DataType>(rr_js_items_type(value_.as_handle()));
}
void JsValue::copy_items(void* to) const {
  rr_js_copy_items(value_.as_handle(), to);
}

int JsValue::read_numbers(double* to, std::size_t count) const {
  return rr_js_read_numbers(value_.as_handle(), to, count);
}

int JsValue::read_booleans(std::uint8_t* to, std::size_t count) const {
  return rr_js_read_booleans(value_.as_handle(), to, count);
}

std::string_view JsValue::kind_text() const {
  switch (kind()) {
    case JsKind::undefined:
      return "undefined";
    case JsKind::null:
      return "null";
    case JsKind::boolean:
      return "a boolean";
    case JsKind::number:
      return "a number";
    case JsKind::bigint:
      return "a bigint";
    case JsKind::text:
      return "a string";
    case JsKind::array:
      return "an array";
    case JsKind::items:
      return "a TypedArray";
    case JsKind::map:
      return "a Map";
    case JsKind::exact:
      return "an rrValue";
    case JsKind::object:
      return "an object";
    case JsKind::other:
      break;
  }
  return "something that is no value";
}

val make_js_text(std::string_view text) {
  return val::take_ownership(rr_js_make_text(text.data(), text.size()));
}
val make_js_number(double value) {
  return val::take_ownership(rr_js_make_number(value));
}
val make_js_boolean(bool value) {
  return val::take_ownership(EM_VAL(value ? emscripten::internal::_EMVAL_TRUE : emscripten::internal::_EMVAL_FALSE));
}
val make_js_bigint(const void* bytes, bool is_unsigned) {
  return val::take_ownership(rr_js_make_bigint(bytes, is_unsigned));
}
val make_js_items(DataType type, ByteSpan bytes) {
  return val::take_ownership(rr_js_make_items(static_cast<int>(type), bytes.data(), bytes.size()));
}
val make_js_booleans(ByteSpan bytes) {
  return val::take_ownership(rr_js_make_booleans(bytes.data(), bytes.size()));
}
val make_js_parts(DataType type, ByteSpan bytes, int part) {
  const bool is_double = type == DataType::cdouble_t;
  const auto part_type = is_double ? DataType::double_t : DataType::single_t;
  return val::take_ownership(
      rr_js_make_parts(static_cast<int>(part_type), bytes.data(), bytes.size() / item_size(type), part));
}
val make_js_object() {
  return val::take_ownership(rr_js_make_object());
}
val make_js_array() {
  return val::take_ownership(rr_js_make_array());
}
val make_js_map() {
  return val::take_ownership(rr_js_make_map());
}
val make_js_view(ByteSpan bytes) {
  return val::take_ownership(rr_js_make_view(bytes.data(), bytes.size()));
}

void set_js_field(const val& object, std::string_view name, const val& value) {
  rr_js_set_field(object.as_handle(), name.data(), name.size(), value.as_handle());
}
void push_js(const val& array, const val& value) {
  rr_js_push(array.as_handle(), value.as_handle());
}
void set_js_key(const val& map, const val& key, const val& value) {
  rr_js_set_key(map.as_handle(), key.as_handle(), value.as_handle());
}
void mark_js_type(const val& object, std::string_view type) {
  rr_js_mark_type(object.as_handle(), type.data(), type.size());
}

}  // namespace rr
