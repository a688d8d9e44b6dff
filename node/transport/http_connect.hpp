// The client's side of HTTP: the upgrade to a WebSocket, and the way through a proxy. Layer: node/transport.
// Source: transports spec section 4.4; RFC 9110 section 9.3.6 (CONNECT).
#pragma once

#include <memory>

#include "core/session/url.hpp"
#include "node/transport/byte_stream.hpp"
#include "node/transport/http_headers.hpp"

namespace rr {

/// Asks the server of `url` for a WebSocket: its path, its whole query (with service, nodeid and nodename, by which
/// gateways route), and `headers` besides the necessary ones.
/// Returns  the WebSocket as a stream of bytes.
/// Errors   connection_error: refused (with status and reason, and what a problem document says of it), an answer that
///          is no upgrade, or the peer has gone.
awaitable<Result<std::unique_ptr<ByteStream>>> connect_websocket(std::unique_ptr<ByteStream> stream, ConnectionUrl url,
                                                                 HttpHeaders headers);

/// Asks an HTTP proxy at the other end for a way to host:port; afterwards the stream goes there.
/// Errors   connection_error: refused (with status and reason), or the proxy has gone.
awaitable<Result<>> connect_through_proxy(ByteStream& proxy, HostPort target);

}  // namespace rr
