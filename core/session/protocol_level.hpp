// The level of Robot Raconteur that this implementation speaks. Layer: session.
#pragma once

#include <string_view>

namespace rr {

/// Sent as `clientversion`: a service then offers the newest types that a client of this level knows.
inline constexpr std::string_view protocol_level = "1.2.8";

}  // namespace rr
