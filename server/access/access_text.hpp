// The texts of users, tokens and roles: lines of words. Layer: server/access.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "core/support/error.hpp"

namespace rrgate {

/// A name that a line and HTTP Basic can hold: 1 to 128 characters, no blank, comma, colon or control character, no '#'
/// or '_' in front. `what` is "user name" or "role". Errors   invalid_argument.
[[nodiscard]] rr::Result<> check_name(std::string_view what, std::string_view name);
/// "a,b" or "" as roles. Errors   as check_name().
rr::Result<std::vector<std::string>> parse_roles(std::string_view text);
/// "a,b", or "_" for none.
std::string format_roles(const std::vector<std::string>& roles);

/// The line of `name` in a users or tokens file; empty: not there.
std::string_view find_line(std::string_view file, std::string_view name);
/// The file with that line in place of the first of `name`, or at the end; all others of `name` are gone. An empty line
/// takes it out.
std::string with_line(std::string_view file, std::string_view name, std::string_view line);

}  // namespace rrgate
