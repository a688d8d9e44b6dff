// The cookie that a sign-in is kept in. Layer: server/http. Source: RFC 6265 with its successor's name prefixes
// (draft-ietf-httpbis-rfc6265bis, section 4.1.3).
#pragma once

#include <string>
#include <string_view>

#include "node/http/message.hpp"

namespace rrgate {

/// "__Host-rrgate" with TLS, so that no other host can set it, "__Secure-rrgate" where a path before the gateway's is
/// part of it; with the port behind, where it isn't that of the scheme: browsers send cookies to all ports of a host.
std::string sign_in_cookie_name(const Arrival& arrival);

/// Empty where the request has none.
std::string_view sign_in_cookie(const HttpRequest& request);

/// Set-Cookie, for scripts out of reach, for the time that the browser runs. Empty: takes the cookie away.
std::string format_sign_in_cookie(const Arrival& arrival, std::string_view cookie);

}  // namespace rrgate
