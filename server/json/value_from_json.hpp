// JSON -> Value, strictly by the declared type. Layer: server/json. Source: service definitions spec section 5.12.
#pragma once

#include "server/json/value_to_json.hpp"

namespace rr {

/// Takes every form that value_to_json() writes. Lengths and shapes that the type declares are checked.
/// Errors   data_type_mismatch, data_type_error, out_of_range, null_value, invalid_argument; the text names the place,
///          from `name` on: "read 'pose.q' (com.x.Pose): has 3, expected 4 (double[4])".
Result<Value> value_from_json(const Json& json, const TypeDefinition& type, const TypeRegistry& types,
                              const JsonForm& form = {}, std::string_view name = "value");

}  // namespace rr
