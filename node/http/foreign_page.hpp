// Requests that somebody else's page makes a browser send. Layer: node/http. Source: transports spec section 4.3,
// made stricter; Fetch Metadata (Sec-Fetch-Site); RFC 9110 section 15.5.20 (421).
#pragma once

#include <optional>
#include <span>
#include <string>

#include "node/http/message.hpp"
#include "node/tls/tls_context.hpp"

namespace rrgate {

/// Whose pages a server serves. All is borrowed.
struct PageRules {
  std::span<const std::string> allowed_origins = {};  ///< patterns of origin.hpp
  std::span<const std::string> allowed_hosts = {};    ///< patterns of origin.hpp, of names of the server
  const rr::TlsContext* tls = nullptr;                ///< its certificates have names of the server; null: none
};

/// 421 where the request names a host that is neither an IP address, "localhost", nor a name of the server. Any other
/// name may be that of a stranger who lets it lead here ("DNS rebinding"): to a browser his page then is the server's
/// own. Both the Host header and the host that a trusted proxy names (HttpRequest::arrival) count.
/// WebSockets without an Origin are no browser's, and pages of allowed origins are nobody else's: they come by any
/// name.
std::optional<Response> refuse_unknown_host(const HttpRequest& request, const PageRules& rules);

/// 403 where a page of an origin that is neither the server's own nor allowed has sent the request. An origin is the
/// server's own where the host is: see above. Browsers that tell no Origin tell the site (Sec-Fetch-Site): from another
/// site a link may lead to the page, not to /api/; from another port of this host whatever changes nothing may be
/// shown.
std::optional<Response> refuse_foreign_page(const HttpRequest& request, const PageRules& rules);

/// Whether a cookie of the server may say who sends the request: whether it is one of the server's own page, or one
/// that somebody typed. Pages of allowed origins are others. What changes something, and what becomes a WebSocket, has
/// to name its origin, as browsers do. Source: Fetch, section 3.1; Fetch Metadata, which browsers leave out in clear.
bool is_from_own_page(const HttpRequest& request);

}  // namespace rrgate
