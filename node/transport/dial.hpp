// The one list of transports that reach a device, by URL scheme. Layer: node/transport.
#pragma once

#include <chrono>
#include <functional>
#include <memory>
#include <vector>

#include "node/tls/tls_context.hpp"
#include "node/transport/byte_stream.hpp"
#include "node/transport/http_connect.hpp"
#include "node/transport/schemes.hpp"

namespace rr {

struct DialOptions {
  std::chrono::milliseconds timeout{5000};
  std::chrono::milliseconds send_stall{15000};
  /// An HTTP proxy between here and hosts of the TCP family, asked by CONNECT; empty host: none.
  HostPort proxy = {};
  /// For the HTTP request of a WebSocket: a token that a gateway wants, say.
  HttpHeaders headers = {};
  /// For the schemes with TLS between nodes ("rrs+..."). Null: no certificate of one's own, and default_trust().
  TlsContextPtr tls = {};
  /// Asked for the stream instead of the transport of the URL's scheme, which is a name then. Null: the list in
  /// dial.cpp.
  std::function<awaitable<Result<std::unique_ptr<ByteStream>>>()> reach = {};
  /// For the schemes by HTTPS ("...+wss"). Null: what this system trusts.
  TlsContextPtr web_tls = {};
};

/// Connects to the device of `url`; nothing is sent but what the scheme itself needs.
/// Errors   connection_error: not reached in time, refused, or a scheme that isn't in the list; those of
///          start_tls_client(), TlsStream::handshake() and make_node_tls().
/// Throws   boost::system::system_error: it was cancelled.
awaitable<Result<std::unique_ptr<ByteStream>>> dial(ConnectionUrl url, DialOptions options);

/// Dials several URLs of one device, 15 ms apart and side by side, best first; the first to be reached wins.
/// Errors   as of race(), with the cause for each URL.
awaitable<Result<std::unique_ptr<ByteStream>>> dial_any(std::vector<ConnectionUrl> urls, DialOptions options);

}  // namespace rr
