// Connection URLs: text <-> parts. Layer: session. Source: transports spec section 1.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/support/error.hpp"
#include "core/support/node_id.hpp"

namespace rr {

/// What a scheme asks of the rest of its URL (the table of section 1.2).
struct UrlScheme {
  std::string_view name;
  std::uint16_t default_port;  ///< 0: the scheme has no port and naming one is an error
  bool needs_host;             ///< TCP family; the others name a node instead of a host
  bool passes_path;            ///< WebSocket: the path goes into the HTTP request
  bool is_secure;              ///< STARTTLS inside the stream ("rrs")
};

/// All schemes of the reference, "tcp" (the old form) last.
const std::vector<UrlScheme>& url_schemes();
/// Null when no such scheme exists. Case-sensitive, as everything in a URL.
const UrlScheme* find_url_scheme(std::string_view name);

/// The parts of a connection URL. `scheme`, `host` and so on are as written; recognised query values are decoded.
struct ConnectionUrl {
  std::string scheme;  ///< "rr+tcp", ...
  std::string host;    ///< without the brackets of IPv6, zone kept raw ("fe80::1%eth0"); empty for host-less schemes
  std::uint16_t port = 0;  ///< the default of the scheme where none is written; 0 for schemes without port
  std::string path;        ///< "" or begins with '/'
  std::string query;       ///< raw, without '?'
  std::string service;
  std::string user;  ///< of "user@localhost" (rr+local)
  std::optional<NodeId> node_id;
  std::string node_name;  ///< empty when the URL names none

  bool operator==(const ConnectionUrl&) const = default;
};

/// What the scheme says: TLS between nodes ("rrs"); HTTPS ("+wss") around that, or alone.
bool has_node_tls(const ConnectionUrl& url);
bool has_https(const ConnectionUrl& url);

enum class ServiceInUrl { required, optional };

/// Parses `text` in the form of section 1.1, or in the legacy form "tcp://host:port/<node>/service", which comes back
/// as scheme "rr+tcp". Without a service (allowed by ServiceInUrl::optional) the query may be missing altogether.
/// Errors   invalid_argument: an empty or malformed nodeid or nodename, a broken % escape in a recognised value.
///          connection_error: everything else. Both say what was found and what was expected.
[[nodiscard]] Result<ConnectionUrl> parse_url(std::string_view text, ServiceInUrl rule = ServiceInUrl::required);

/// Canonical text: the port is written unless it is the default, the query as it was received.
std::string format_url(const ConnectionUrl& url);

/// The host of a URL without the zone of an IPv6 address, which means something on this machine alone. Borrows `host`.
std::string_view without_zone(std::string_view host);

/// "host:port" with brackets around IPv6.
std::string format_host_port(std::string_view host, std::uint16_t port);

/// Splits "host:port" and "[v6]:port" (a listen address). Port 0 is allowed: the system chooses one.
struct HostPort {
  std::string host;
  std::uint16_t port = 0;
  bool operator==(const HostPort&) const = default;
};
/// Errors   invalid_argument.
[[nodiscard]] Result<HostPort> parse_host_port(std::string_view text);

/// First value of `name` in a raw query ("a=b&c=d"), percent-decoded; nullopt when absent. Lenient: parts that are not
/// name=value are skipped and a broken escape stays as it is. For queries that a client put into an HTTP request.
std::optional<std::string> query_value(std::string_view query, std::string_view name);

/// Decodes %XX. Errors   invalid_argument: a '%' without two hex digits.
[[nodiscard]] Result<std::string> percent_decode(std::string_view text);
/// Encodes everything but RFC 3986's unreserved characters.
std::string percent_encode(std::string_view text);

}  // namespace rr
