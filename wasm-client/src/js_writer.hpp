// One value for JavaScript, written as bytes in the core's memory and built by a single call into the page.
// Layer: wasm-client/src. The other half is JsReader in ts/js_reader.ts, which shares the numbers of the codes.
#pragma once

#include <cstdint>
#include <string_view>

#include "wasm-client/src/js_access.hpp"

namespace rr {

/// Values are written one after the other; what is begun contains all that follows until end(). Within an object, key()
/// stands before each value; within a map, each key is a value of its own. There is one buffer for all: a value is
/// built before the next one is begun.
class JsWriter {
 public:
  void null();
  void boolean(bool value);
  void number(double value);
  /// The eight bytes of a 64-bit integer.
  void bigint(const std::uint8_t* bytes, bool is_unsigned);
  /// Copied.
  void text(std::string_view text);
  /// A text that comes again and again, as names do: JavaScript decodes it once.
  void name(std::string_view text);
  /// A TypedArray; `type` is one of 1..10. `bytes` are borrowed until build().
  void items(DataType type, ByteSpan bytes);
  /// An array of booleans. `bytes` are borrowed until build().
  void booleans(ByteSpan bytes);
  /// Every second number of complex ones, as TypedArray; `part` 0: real, 1: imaginary. `bytes` are borrowed until
  /// build().
  void parts(DataType type, ByteSpan bytes, int part);
  /// A value of JavaScript itself, borrowed until build().
  void value(const JsValue& js);

  void begin_object();
  void begin_array();
  void begin_map();
  void end();
  /// Within an object. `name` is decoded once, as name() is.
  JsWriter& key(std::string_view name);
  /// Names the type of the object or array that is open.
  void mark(std::string_view type);

  /// Ends what is open, and makes the value: one call from WebAssembly to JavaScript.
  JsValue build();

 private:
  enum class Code : std::uint8_t;

  int open_ = 0;
};

JsValue make_js_text(std::string_view text);

}  // namespace rr
