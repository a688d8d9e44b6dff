// HTTP clients: requests to the router, upgrades to a relay. Layer: server/front.
#pragma once

#include <memory>

#include "server/state/gateway_state.hpp"

namespace rrgate {

/// Serves requests, kept alive and pipelined, until the connection ends or becomes a WebSocket.
/// Returns  what serves that, to be awaited when nothing of HTTP is held any more; not valid() where it has ended.
rr::awaitable<rr::awaitable<void>> serve_http_client(GatewayState& gateway, Connection& connection,
                                                     std::unique_ptr<rr::ByteStream> stream);

}  // namespace rrgate
