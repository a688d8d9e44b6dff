// The client's side of HTTP: the upgrade to a WebSocket, and the way through a proxy. Layer: server/transport.
// Source: transports spec section 4.4; RFC 9110 section 9.3.6 (CONNECT).
#pragma once

#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "core/session/url.hpp"
#include "server/transport/byte_stream.hpp"

namespace rr {

using HttpHeaders = std::vector<std::pair<std::string, std::string>>;

/// Asks the server of `url` for a WebSocket: its path, its whole query (with service, nodeid and nodename, by which
/// gateways route), and `headers` besides the necessary ones.
/// Returns  the WebSocket as a stream of bytes.
/// Errors   connection_error: refused (with status and reason), an answer that is no upgrade, or the peer has gone.
awaitable<Result<std::unique_ptr<ByteStream>>> connect_websocket(std::unique_ptr<ByteStream> stream, ConnectionUrl url,
                                                                 HttpHeaders headers);

/// Asks an HTTP proxy at the other end for a way to host:port; afterwards the stream goes there.
/// Errors   connection_error: refused (with status and reason), or the proxy has gone.
awaitable<Result<>> connect_through_proxy(ByteStream& proxy, HostPort target);

/// Whether text can stand as name and value of a header: no control characters, no name that the upgrade sets itself.
bool is_extra_header(std::string_view name, std::string_view value);

}  // namespace rr
