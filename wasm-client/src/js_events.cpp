#include "wasm-client/src/js_events.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "wasm-client/src/value_to_js.hpp"

namespace rr {

Now make_now(double steady, double utc) {
  const auto since_start = std::chrono::duration<double, std::milli>(steady);
  Now now;
  now.steady = TimePoint(std::chrono::duration_cast<TimePoint::duration>(since_start));
  const double seconds = std::floor(utc / 1000);
  now.utc.seconds = static_cast<std::int64_t>(seconds);
  now.utc.nanoseconds = static_cast<std::int32_t>((utc - seconds * 1000) * 1e6);
  return now;
}

double to_js_time(TimePoint at) {
  if (at == TimePoint::max()) return std::numeric_limits<double>::infinity();
  return std::chrono::duration<double, std::milli>(at.time_since_epoch()).count();
}

std::chrono::milliseconds to_milliseconds(double number) {
  constexpr double a_month = 31.0 * 24 * 3600 * 1000;
  return std::chrono::milliseconds(static_cast<std::int64_t>(std::min(number, a_month)));
}

std::string text_of(const JsValue& js) {
  return js.text().value_or(std::string());
}

void begin_event(JsWriter& js, std::string_view kind) {
  js.begin_object();
  js.key("kind").name(kind);
}

bool is_varvalue(const TypeDefinition& type) {
  return type.type == DataType::varvalue_t;
}

void write_arguments(JsWriter& js, const std::vector<Value>& values, const MemberDefinition* member,
                     const TypeRegistry& types) {
  js.begin_array();
  for (std::size_t i = 0; i < values.size(); ++i) {
    const bool brings_type = member && i < member->parameters.size() && is_varvalue(member->parameters[i].type);
    write_js(js, values[i], types, brings_type);
  }
  js.end();
}

Error error_from_js(const JsValue& js) {
  const auto text = [&](std::string_view field) {
    const auto found = js.field(field);
    return found && found->kind() == JsKind::text ? text_of(*found) : std::string();
  };
  Error error{ErrorCode::unknown_error, text("message"), text("name")};
  error.sub_name = text("subName");
  if (const auto code = js.field("code"); code && code->kind() == JsKind::number)
    error.code = static_cast<ErrorCode>(code->number());
  return error;
}

}  // namespace rr
