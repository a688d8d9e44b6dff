// Who may open a WebSocket: the Origin rules. Layer: node/http. Source: transports spec section 4.3, made stricter.
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace rrgate {

/// scheme://host[:port], or scheme://*.domain[:port] for all names below a domain.
bool is_origin_pattern(std::string_view text);

/// Whether a page of `origin` may connect. `host` is the request's Host header. The gateway's own pages may, and those
/// of `allowed` (patterns as above). "null", lists, and anything that isn't scheme://host[:port] never may.
/// Schemes and host names compare without case; the default port of http and https equals none.
bool is_origin_allowed(std::string_view origin, std::string_view host, const std::vector<std::string>& allowed);

}  // namespace rrgate
