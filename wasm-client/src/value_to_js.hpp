// Value -> JavaScript value. Layer: wasm-client/src. The table of forms stands in wasm-client/README.md.
#pragma once

#include "core/types/type_registry.hpp"
#include "core/types/value.hpp"
#include "wasm-client/src/js_writer.hpp"

namespace rr {

/// Arrays are copied once, from the wasm heap into a TypedArray of their own. `value` is borrowed until js.build().
/// `types` tells the fields of named arrays.
/// `is_varvalue`  the value brought its type along: what JavaScript cannot tell from the value alone (the name of a
///                structure, pod or named array) is marked on the object, so that it can be sent back.
void write_js(JsWriter& js, const Value& value, const TypeRegistry& types, bool is_varvalue = false);

/// {code, name, subName, param, message}
void write_js(JsWriter& js, const Error& error, const TypeRegistry& types);
JsValue to_js(const Error& error, const TypeRegistry& types);

}  // namespace rr
