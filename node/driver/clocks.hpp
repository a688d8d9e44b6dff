// The native clocks, for the calls of the core that take the time. Layer: node/driver.
#pragma once

#include <algorithm>
#include <chrono>

#include "core/support/time.hpp"

namespace rr {

/// Both clocks, read now.
Now read_clocks();

/// `duration`, or a hundred years where it is longer: the clocks, which count nanoseconds, have no time behind 292.
constexpr std::chrono::milliseconds bounded(std::chrono::milliseconds duration) {
  return std::min<std::chrono::milliseconds>(duration, std::chrono::years(100));
}

}  // namespace rr
