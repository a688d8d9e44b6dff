// JavaScript values as the bindings see them: a handle that is always released, and operations that never throw.
// Layer: wasm-client/src. The other half is js_access.js.
#pragma once

#include <emscripten/val.h>

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "core/wire/message.hpp"

namespace rr {

/// The numbers are shared with js_access.js.
enum class JsKind : std::uint8_t {
  undefined,
  null,
  boolean,
  number,
  bigint,
  text,
  array,
  items,  ///< a TypedArray
  map,    ///< a Map
  exact,  ///< what rrValue() makes
  object,
  other,  ///< functions, symbols, dates, buffers without item type, revoked proxies
};

using emscripten::val;

/// One value of JavaScript. Reading never throws: what application code throws on the way reads as "failed".
class JsValue {
 public:
  explicit JsValue(val value) : value_(std::move(value)) {}
  static JsValue undefined() { return JsValue(val::undefined()); }

  JsKind kind() const;
  bool is_nullish() const { return value_.isUndefined() || value_.isNull(); }
  bool is_true() const { return value_.isTrue(); }
  /// Only for numbers.
  double number() const;
  /// Only for bigints; nothing where it does not fit 64 bits.
  std::optional<std::int64_t> int64() const;
  std::optional<std::uint64_t> uint64() const;
  /// Only for text. Nothing where it has no UTF-8 (a surrogate that stands alone).
  std::optional<std::string> text() const;

  /// Arrays and items; nothing where reading failed.
  std::optional<std::size_t> length() const;
  std::optional<JsValue> at(std::size_t index) const;
  /// Objects: undefined where there is no such field; nothing where a getter failed.
  std::optional<JsValue> field(std::string_view name) const;
  /// Objects: an array of the own keys.
  std::optional<JsValue> keys() const;
  /// Maps: an array [key, value, key, value, ...].
  std::optional<JsValue> map_items() const;
  /// The type that a value brings with it, as those of varvalues do.
  std::optional<std::string> type_mark() const;
  /// Items: their type.
  DataType items_type() const;
  /// Items: copies the bytes of all of them.
  void copy_items(void* to) const;
  /// Reads `count` numbers (booleans) of an array or items. -1: done; -2: reading failed; else the first other value.
  int read_numbers(double* to, std::size_t count) const;
  int read_booleans(std::uint8_t* to, std::size_t count) const;

  /// "a string", "an array", ...: for messages.
  std::string_view kind_text() const;
  const val& handle() const { return value_; }

 private:
  val value_;
};

/// Making values.
val make_js_text(std::string_view text);
val make_js_number(double value);
val make_js_boolean(bool value);
val make_js_bigint(const void* bytes, bool is_unsigned);
/// A TypedArray with a copy of the bytes; `type` is one of 1..10.
val make_js_items(DataType type, ByteSpan bytes);
val make_js_booleans(ByteSpan bytes);
/// Every second number of complex ones, as TypedArray; `part` 0: real, 1: imaginary.
val make_js_parts(DataType type, ByteSpan bytes, int part);
val make_js_object();
val make_js_array();
val make_js_map();
/// A Uint8Array on the heap itself: valid until the heap grows, so until the next call into the module.
val make_js_view(ByteSpan bytes);

void set_js_field(const val& object, std::string_view name, const val& value);
void push_js(const val& array, const val& value);
void set_js_key(const val& map, const val& key, const val& value);
void mark_js_type(const val& object, std::string_view type);

}  // namespace rr
