// Origins of pages and names of hosts, as browsers send them, and patterns of both. Layer: node/http.
// Source: RFC 6454 (Origin), RFC 9110 section 7.2 (Host).
#pragma once

#include <span>
#include <string>
#include <string_view>

namespace rrgate {

// Schemes and host names compare without case; the default port of http and https equals none. "null", lists, and
// anything that isn't scheme://host[:port], or host[:port], fits nothing.

/// scheme://host[:port], or scheme://*.domain[:port] for all names below a domain.
bool is_origin_pattern(std::string_view text);
bool is_origin_listed(std::string_view origin, std::span<const std::string> patterns);

/// Whether a page of `origin` was loaded from `authority`, host[:port], in the way in which it asks now. A page that
/// came in clear is not the one that comes by TLS: anybody on the way may have written it. The other way round TLS has
/// ended before, at a proxy that says nothing of it: browsers let no page from HTTPS ask in clear.
bool is_same_origin(std::string_view origin, std::string_view authority, bool is_encrypted);

/// A host without a port, or *.domain for all names below a domain.
bool is_host_pattern(std::string_view text);
/// Whether the host of `authority`, host[:port], is an IP address, "localhost", or fits one of the patterns.
bool is_host_listed(std::string_view authority, std::span<const std::string> patterns);

/// In lower case, without the port; IPv6 addresses with brackets. Empty where `authority` isn't host[:port].
std::string host_name_of(std::string_view authority);

}  // namespace rrgate
