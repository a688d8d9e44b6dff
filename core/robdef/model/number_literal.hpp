// Numbers as definitions write them. Layer: robdef. Source: service definitions spec sections 5.3, 5.5.2.
#pragma once

#include <cstdint>
#include <string_view>

namespace rr {

bool is_float_literal(std::string_view text);
/// Only of what is_float_literal() accepts. Rounded once, to single or double; infinite on overflow.
double parse_float_literal(std::string_view text, bool is_single);

/// INT or HEX of enums and constants: the sign, the magnitude, the notation.
struct IntegerLiteral {
  bool is_negative = false;
  bool is_hex = false;
  bool is_too_large = false;  ///< beyond 64 bits
  std::uint64_t magnitude = 0;
};
/// False where the text is neither.
bool parse_integer_literal(std::string_view text, IntegerLiteral& out);
/// Any number: INT, HEX or FLOAT.
bool is_number_literal(std::string_view text);

}  // namespace rr
