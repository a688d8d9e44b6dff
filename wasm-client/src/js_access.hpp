// JavaScript values as the bindings see them: a handle that is always released, and operations that never throw.
// Layer: wasm-client/src. The other half is ts/js_values.ts.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

#include "core/wire/message.hpp"

namespace rr {

/// A place in the table of ts/js_values.ts. The first ones are the same for everybody and never released.
enum class JsHandle : std::uint32_t {
  failed,  ///< what reading gives where application code threw
  undefined,
  null,
  yes,
  no,
  last_constant = no,
};

/// The numbers are shared with ts/js_values.ts.
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

/// One value of JavaScript. Reading never throws: what application code throws on the way reads as "failed".
class JsValue {
 public:
  /// Takes the handle over.
  explicit JsValue(JsHandle handle) : handle_(handle) {}
  JsValue(const JsValue& other);
  JsValue(JsValue&& other) noexcept : handle_(other.release()) {}
  JsValue& operator=(JsValue other) noexcept {
    std::swap(handle_, other.handle_);
    return *this;
  }
  ~JsValue();
  static JsValue undefined() { return JsValue(JsHandle::undefined); }
  static JsValue null() { return JsValue(JsHandle::null); }

  JsKind kind() const;
  bool is_nullish() const { return handle_ == JsHandle::undefined || handle_ == JsHandle::null; }
  bool is_true() const { return handle_ == JsHandle::yes; }
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
  JsHandle handle() const { return handle_; }
  /// Gives the handle away: to JavaScript, as what an exported function returns.
  JsHandle release() { return std::exchange(handle_, JsHandle::undefined); }

 private:
  JsHandle handle_;
};

}  // namespace rr
