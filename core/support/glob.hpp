// Patterns with '*' and '?'. Layer: support.
#pragma once

#include <string_view>

namespace rr {

/// '*' stands for any characters, '?' for one. Takes no more than size * size steps.
bool glob_matches(std::string_view pattern, std::string_view text);

}  // namespace rr
