// The native clocks, for the calls of the core that take the time. Layer: node/driver.
#pragma once

#include "core/support/time.hpp"

namespace rr {

/// Both clocks, read now.
Now read_clocks();

}  // namespace rr
