// The versions at which the language changes. Layer: robdef. Source: service definitions spec section 5.2.
#pragma once

#include "core/robdef/model/service_definition.hpp"

namespace rr {

/// The lowest one that `stdver` takes; below it, `option version` lacks features.
inline constexpr Version first_stdver{0, 9, 0, 0};
/// From here on there are no options, and `end` stands alone.
inline constexpr Version first_without_options{0, 9, 2, 0};
/// The level of Robot Raconteur that we know; definitions above it are refused.
inline constexpr Version newest_known{1, 2, 8, 0};

}  // namespace rr
