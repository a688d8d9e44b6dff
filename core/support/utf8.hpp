// UTF-8: whether text is, where to cut it, and code points as. Layer: support. Source: Unicode 15, table 3-7; RFC 3629.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

namespace rr {

/// Bytes of the character that `text`, which is not empty, begins with; 0: it begins with none.
std::size_t utf8_character_size(std::string_view text);

/// The shortest form of each character, no surrogates, nothing above U+10FFFF. Empty text is UTF-8.
bool is_utf8(std::string_view text);

/// The beginning of `text`: at most `limit` bytes, and no part of a character of UTF-8 at its end. Where the text is
/// not UTF-8, all of the `limit`.
std::string_view utf8_prefix(std::string_view text, std::size_t limit);

/// `code`  0..0x10FFFF; surrogates become three bytes like any other.
void append_utf8(std::string& out, std::uint32_t code);

}  // namespace rr
