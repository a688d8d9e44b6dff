// FLOAT literals. Layer: robdef. Source: service definitions spec sections 5.3, 5.5.2.
#pragma once

#include <string_view>

namespace rr {

bool is_float_literal(std::string_view text);
/// Only of what is_float_literal() accepts. Rounded once, to single or double; infinite on overflow.
double parse_float_literal(std::string_view text, bool is_single);

}  // namespace rr
