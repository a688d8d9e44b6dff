// What a configuration allows that its operator may not have meant. Layer: server/config.
#pragma once

#include <vector>

#include "server/config/config.hpp"

namespace rrgate {

/// Nothing of it is a mistake: the gateway starts.
std::vector<Finding> find_cautions(const Config& config);

}  // namespace rrgate
