// Patterns with '*' and '?'. Layer: support.
#pragma once

#include <string_view>

namespace rr {

/// '*' stands for any characters, '?' for one. Takes no more than size * size steps.
bool glob_matches(std::string_view pattern, std::string_view text);

/// Whether the pattern fits any text that begins so. Takes pattern.size() times the steps of glob_matches().
bool glob_leads_on(std::string_view pattern, std::string_view beginning);

}  // namespace rr
