// Whether text is UTF-8. Layer: support. Source: Unicode 15, table 3-7.
#pragma once

#include <string_view>

namespace rr {

/// The shortest form of each character, no surrogates, nothing above U+10FFFF. Empty text is UTF-8.
bool is_utf8(std::string_view text);

}  // namespace rr
