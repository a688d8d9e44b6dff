// JPEG pictures for tests. Test support.
#pragma once

#include <cstdint>
#include <vector>

#include "examples/demo/world.hpp"

namespace rrgate::demo {

/// All pixels of one colour.
std::vector<std::uint8_t> make_jpeg(unsigned width, unsigned height, Color color, bool is_progressive = false);

}  // namespace rrgate::demo
