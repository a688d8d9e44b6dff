// Headers that are added to a WebSocket's HTTP request. Layer: node/transport. Kept apart from http_connect.hpp,
// which needs Asio.
#pragma once

#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace rr {

using HttpHeaders = std::vector<std::pair<std::string, std::string>>;

/// Whether text can stand as name and value of a header: no control characters, no name that the upgrade sets itself.
bool is_extra_header(std::string_view name, std::string_view value);

}  // namespace rr
