// Who a client is, and by which URL it came, seen through reverse proxies. Layer: server/http. Source: RFC 7239, and
// what nginx, Apache httpd, HAProxy, Caddy and Traefik send in X-Forwarded-*.
#pragma once

#include <boost/asio/ip/address.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "node/http/message.hpp"

namespace rrgate {

/// Addresses that begin with the same bits.
struct AddressRange {
  boost::asio::ip::address address;
  unsigned bits = 0;

  bool contains(const boost::asio::ip::address& other) const;
  bool operator==(const AddressRange&) const = default;
};

/// "10.0.0.0/8", "fd00::/8", or one address. nullopt for anything else, and where bits behind the prefix are set.
std::optional<AddressRange> parse_address_range(std::string_view text);

/// "::ffff:192.0.2.1" is 192.0.2.1.
boost::asio::ip::address plain_address(const boost::asio::ip::address& address);

/// Which headers the trusted proxies set. Never both kinds: a proxy that sets the one passes on what a client invented
/// in the other.
enum class ForwardedBy { x_forwarded, forwarded };

struct ProxyTrust {
  std::vector<AddressRange> proxies;
  ForwardedBy headers = ForwardedBy::x_forwarded;

  bool trusts(const boost::asio::ip::address& address) const;
  bool operator==(const ProxyTrust&) const = default;
};

/// What the connection itself says, before any header. Its address is the proxy's where there is one.
struct Peer {
  boost::asio::ip::tcp::endpoint endpoint;
  bool is_encrypted = false;
};

/// How a request came. Headers count only from a trusted proxy. The client is the last address that no trusted proxy
/// has; where a proxy in the row does not know the address before it, that proxy.
Arrival see_through_proxies(const HttpRequest& request, const Peer& peer, const ProxyTrust& trust);

/// "/robots/api" -> true: begins with '/', no '/' at its end, plain segments. "" is a prefix too, of nothing.
bool is_path_prefix(std::string_view text);

/// Takes `base_path` ("" or "/robots") from the front of the request's path, if it is there, and notes it in
/// `arrival.prefix`. Requests without it stay as they are: the proxy has taken it off, or there is none.
void take_base_path(HttpRequest& request, std::string_view base_path);

}  // namespace rrgate
