// A page that is a device: its WebSockets at /serve/NAME. Layer: server/front.
// Source: docs/adr/0013-a-page-as-a-device.md.
#pragma once

#include <memory>

#include "server/state/gateway_state.hpp"

namespace rrgate {

/// Of the socket by which a page is told which connections to open: JSON, from the gateway alone.
inline constexpr std::string_view serve_subprotocol = "rrgate.serve.v1";

/// Whether a request to become a WebSocket is of a page that is a device, or wants to be one.
bool is_page_device(const Request& request);
/// Whether it opens a connection to such a page, which by its key the gateway has asked for: that is proof enough.
bool is_awaited_page(GatewayState& gateway, const Request& request);
/// What it has to name, if it names any.
std::string_view page_subprotocol(const Request& request);

/// Serves the socket of a page, whose upgrade is accepted here: it is refused by closing it, which a page can read.
/// Returns  what serves it, see serve_http_client().
rr::awaitable<rr::awaitable<void>> accept_page_device(GatewayState& gateway, Connection& connection,
                                                      std::unique_ptr<rr::ByteStream> stream, const Request& request,
                                                      rr::ByteSpan unread);

}  // namespace rrgate
