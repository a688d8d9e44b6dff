// How much memory a value takes. Layer: types.
#pragma once

#include <cstddef>

#include "core/types/value.hpp"

namespace rr {

/// Bytes, about: itself, names and texts, and payloads, also where other values share them.
std::size_t held_bytes(const Value& value);

}  // namespace rr
