// Callback: a function of the client, called by the service. Layer: member. Source: sessions spec section 2.9.
// Parameters and return value travel as those of functions: see arguments.hpp.
#pragma once

#include <cstdint>

namespace rr {

/// One call of a callback, on either side; never 0, never used again in its session.
using CallbackId = std::uint64_t;

}  // namespace rr
