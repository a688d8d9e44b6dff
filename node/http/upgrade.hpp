// Whether a request becomes a WebSocket. Layer: node/http. Source: transports spec section 4.2.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "node/http/message.hpp"
#include "node/transport/websocket_frames.hpp"

namespace rrgate {

/// Whether the request asks to become a WebSocket at all.
bool asks_for_websocket(const HttpRequest& request);

/// Checks an upgrade, by the host that the client named (HttpRequest::arrival): method and version, Upgrade, key and
/// version (426), subprotocol if named (426), Origin if sent (403). nullopt: all is well.
std::optional<Response> refuse_upgrade(const HttpRequest& request, const std::vector<std::string>& allowed_origins,
                                       std::string_view subprotocol = rr::websocket_subprotocol);

/// The 101 response, with `Connection: Upgrade` alone: native clients compare it as a single token.
/// Those expect the subprotocol in any case; other clients only where they have named it.
std::string format_upgrade_response(const HttpRequest& request,
                                    std::string_view subprotocol = rr::websocket_subprotocol);

/// 426, with the headers that say what is expected.
Response upgrade_required(std::string_view detail, std::string_view subprotocol = rr::websocket_subprotocol);

/// Whether the peer is a browser or another full WebSocket client, which takes close frames. Native Robot Raconteur
/// peers send neither Origin nor extensions, and take a close frame for an error.
bool takes_close_frames(const HttpRequest& request);

}  // namespace rrgate
