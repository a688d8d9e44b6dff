#include "wasm-client/src/js_access.hpp"

#include <cstdlib>

using rr::JsHandle;

/// Functions that ts/js_values.ts brings.
#define RR_JS(name) __attribute__((import_module("js"), import_name(#name)))

extern "C" {
RR_JS(copy) JsHandle rr_js_copy(JsHandle value);
RR_JS(release) void rr_js_release(JsHandle value);

RR_JS(kind) int rr_js_kind(JsHandle value);
RR_JS(items_type) int rr_js_items_type(JsHandle value);
RR_JS(number) double rr_js_number(JsHandle value);
RR_JS(bigint) int rr_js_bigint(JsHandle value, int is_unsigned, void* to);
RR_JS(text) char* rr_js_text(JsHandle value, std::size_t* length);
RR_JS(length) int rr_js_length(JsHandle value);
RR_JS(item) JsHandle rr_js_item(JsHandle value, int index);
RR_JS(field) JsHandle rr_js_field(JsHandle value, const char* name, std::size_t length);
RR_JS(keys) JsHandle rr_js_keys(JsHandle value);
RR_JS(map_items) JsHandle rr_js_map_items(JsHandle value);
RR_JS(type_mark) JsHandle rr_js_type_mark(JsHandle value);
RR_JS(copy_items) void rr_js_copy_items(JsHandle value, void* to);
RR_JS(read_numbers) int rr_js_read_numbers(JsHandle value, double* to, std::size_t count);
RR_JS(read_booleans) int rr_js_read_booleans(JsHandle value, std::uint8_t* to, std::size_t count);
}

namespace rr {

namespace {

std::optional<JsValue> take(JsHandle handle) {
  if (handle == JsHandle::failed) return std::nullopt;
  return JsValue(handle);
}

bool is_constant(JsHandle handle) {
  return handle <= JsHandle::last_constant;
}

}  // namespace

JsValue::JsValue(const JsValue& other)
    : handle_(is_constant(other.handle_) ? other.handle_ : rr_js_copy(other.handle_)) {}

JsValue::~JsValue() {
  if (!is_constant(handle_)) rr_js_release(handle_);
}

JsKind JsValue::kind() const {
  return static_cast<JsKind>(rr_js_kind(handle_));
}
double JsValue::number() const {
  return rr_js_number(handle_);
}

std::optional<std::int64_t> JsValue::int64() const {
  std::int64_t number = 0;
  if (!rr_js_bigint(handle_, false, &number)) return std::nullopt;
  return number;
}

std::optional<std::uint64_t> JsValue::uint64() const {
  std::uint64_t number = 0;
  if (!rr_js_bigint(handle_, true, &number)) return std::nullopt;
  return number;
}

std::optional<std::string> JsValue::text() const {
  std::size_t length = 0;
  char* text = rr_js_text(handle_, &length);
  if (!text) return std::nullopt;
  std::string copy(text, length);
  std::free(text);
  return copy;
}

std::optional<std::size_t> JsValue::length() const {
  const int length = rr_js_length(handle_);
  if (length < 0) return std::nullopt;
  return static_cast<std::size_t>(length);
}

std::optional<JsValue> JsValue::at(std::size_t index) const {
  return take(rr_js_item(handle_, static_cast<int>(index)));
}

std::optional<JsValue> JsValue::field(std::string_view name) const {
  return take(rr_js_field(handle_, name.data(), name.size()));
}

std::optional<JsValue> JsValue::keys() const {
  return take(rr_js_keys(handle_));
}
std::optional<JsValue> JsValue::map_items() const {
  return take(rr_js_map_items(handle_));
}

std::optional<std::string> JsValue::type_mark() const {
  const auto mark = take(rr_js_type_mark(handle_));
  if (!mark || mark->is_nullish()) return std::nullopt;
  return mark->text();
}

DataType JsValue::items_type() const {
  return static_cast<DataType>(rr_js_items_type(handle_));
}
void JsValue::copy_items(void* to) const {
  rr_js_copy_items(handle_, to);
}

int JsValue::read_numbers(double* to, std::size_t count) const {
  return rr_js_read_numbers(handle_, to, count);
}

int JsValue::read_booleans(std::uint8_t* to, std::size_t count) const {
  return rr_js_read_booleans(handle_, to, count);
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

}  // namespace rr
