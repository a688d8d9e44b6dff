// Conversions between number types that lose nothing. Layer: types. Source: messages spec section 7.
#pragma once

#include <string>

#include "core/types/value.hpp"

namespace rr {

enum class Conversion : std::uint8_t { ok, wrong_kind, out_of_range };

/// Converts one number to the type `to`:
/// - integers, and floating values without fraction, to any integer or floating type that holds exactly this value
/// - between double and single, rounding to the nearest; a finite value never becomes infinite
/// - real to complex, and between the complex types, by the same rules for each part
/// - bool only to bool
/// Returns  wrong_kind where no such value could ever convert (1.5 or NaN to int32, int32 to bool), out_of_range where
///          this one does not fit. `out` is set on ok alone.
Conversion convert_number(const Scalar& from, DataType to, Scalar& out);

/// "300", "-1.5", "true", "1+2i": for messages.
std::string number_text(const Scalar& number);

}  // namespace rr
