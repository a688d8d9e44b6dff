// Whether a value is another one than before, without the one before. Layer: server/mcp.
#pragma once

#include <cstddef>

#include "core/types/value.hpp"

namespace rrgate {

/// The same for equal values.
std::size_t hash_of(const rr::Value& value);

}  // namespace rrgate
