// Text of devices, files and logs for the terminal. Layer: server/cli.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

namespace rrgate {

enum class LineEnds : std::uint8_t { replaced, kept };

/// The text with "?" for each control character: ASCII's (escape sequences begin with one), DEL, and those of
/// U+0080 to U+009F, which some terminals obey like escape sequences. `line_ends`  kept: newlines and tabs stay.
std::string printable(std::string_view text, LineEnds line_ends = LineEnds::replaced);

}  // namespace rrgate
