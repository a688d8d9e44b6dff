// The arguments of functions, events and callbacks as JSON, by the names of the parameters. Layer: server/json.
#pragma once

#include <span>
#include <vector>

#include "server/json/value_from_json.hpp"

namespace rr {

/// The arguments of a function from {"name": value, ...}.
/// Errors   those of value_from_json(); invalid_argument: missing, unknown or superfluous names.
Result<std::vector<Value>> arguments_from_json(const Json& json, const MemberDefinition& member,
                                               const TypeRegistry& types, const JsonForm& form);

/// The other way, for what events tell and callbacks ask.
Result<OrderedJson> arguments_to_json(std::span<const Value> arguments, const MemberDefinition& member,
                                      const TypeRegistry& types, const JsonForm& form);

}  // namespace rr
