// What pages of other origins may read: those of allowed_origins alone; others have been refused before.
// Layer: server/http. Source: Fetch standard, CORS protocol.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "server/http/router.hpp"

namespace rrgate {

/// The headers that let the page of `request` read the answer; none where no page asks.
std::vector<std::pair<std::string, std::string>> headers_for_page(const Request& request);

/// OPTIONS, which a browser asks before it sends anything but plain requests.
Handler preflight_endpoint();

}  // namespace rrgate
