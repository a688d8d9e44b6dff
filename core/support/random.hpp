// The one source of randomness of the core: the system's. Layer: support.
#pragma once

#include <chrono>
#include <cstdint>

#include "core/support/node_id.hpp"

namespace rr {

std::uint32_t random_u32();

/// A random (version 4) UUID.
NodeId random_node_id();

/// An endpoint number: random, never 0 ("no session").
std::uint32_t random_endpoint();

/// From `least` to `most`, both included.
std::chrono::milliseconds random_between(std::chrono::milliseconds least, std::chrono::milliseconds most);

}  // namespace rr
