// The line, or the block, in which a TCP proxy says who its client is. Layer: server/front.
// Source: HAProxy's proxy-protocol.txt, versions 1 and 2.
#pragma once

#include <boost/asio/ip/tcp.hpp>
#include <optional>

#include "core/support/bytes.hpp"
#include "core/support/error.hpp"

namespace rrgate {

struct ProxyHeader {
  std::size_t size = 0;  ///< bytes; 0: it isn't complete yet
  /// Unset where the proxy speaks for itself (a health check), or its client has no IP address.
  std::optional<boost::asio::ip::tcp::endpoint> client;
};

/// No proxy has more to say.
inline constexpr std::size_t largest_proxy_header = 2048;

/// `bytes` is what the connection began with, so far.
/// Errors   protocol_error: no PROXY header, a broken one, or one longer than largest_proxy_header.
[[nodiscard]] rr::Result<ProxyHeader> parse_proxy_header(rr::ByteSpan bytes);

}  // namespace rrgate
