// What both sides of a session say to JavaScript, and read from it, alike. Layer: wasm-client/src.
#pragma once

#include <chrono>
#include <string>
#include <string_view>
#include <vector>

#include "core/support/time.hpp"
#include "core/types/type_registry.hpp"
#include "core/types/value.hpp"
#include "wasm-client/src/js_writer.hpp"

namespace rr {

/// `steady` of performance.now(), `utc` of Date.now(): milliseconds.
Now make_now(double steady, double utc);
/// By performance.now(); Infinity for never.
double to_js_time(TimePoint at);
/// A month at most: "never" for a page; further would overflow somewhere.
std::chrono::milliseconds to_milliseconds(double number);
/// Empty where it is no text.
std::string text_of(const JsValue& js);
/// {kind, and what is written next. build() ends it.
void begin_event(JsWriter& js, std::string_view kind);
bool is_varvalue(const TypeDefinition& type);
/// What came with a call. `member` nullptr where it is not known any more.
void write_arguments(JsWriter& js, const std::vector<Value>& values, const MemberDefinition* member,
                     const TypeRegistry& types);
/// {code, name, subName, message}
Error error_from_js(const JsValue& js);

}  // namespace rr
