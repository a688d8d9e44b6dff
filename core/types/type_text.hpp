// Types by their text, where a value brings its own. Layer: types. Source: service definitions spec section 5.12.
#pragma once

#include <string_view>

#include "core/types/type_registry.hpp"

namespace rr {

/// A value's type as a definition would write it, with qualified names: "int16[]", "com.x.Pose[*]", "string{list}",
/// "varvalue{string}". Errors   invalid_argument: not a type, unknown, or none that a varvalue can say (a bare
/// varvalue, void, a generator, an object).
Result<TypeDefinition> parse_type_text(std::string_view text, const TypeRegistry& types);

}  // namespace rr
