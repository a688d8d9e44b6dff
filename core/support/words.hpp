// Words of a text. Layer: support.
#pragma once

#include <string_view>
#include <vector>

namespace rr {

/// What stands between `separators`, of which any number may follow one another. Borrows from `text`.
std::vector<std::string_view> split_words(std::string_view text, std::string_view separators = " \t\r\v\f");

/// Without the `blanks` at both ends. Borrows from `text`.
std::string_view trim(std::string_view text, std::string_view blanks = " \t");

}  // namespace rr
