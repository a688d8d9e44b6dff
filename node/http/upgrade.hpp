// Whether a request becomes a WebSocket. Layer: node/http. Source: transports spec section 4.2.
#pragma once

#include <optional>
#include <string>

#include "node/http/message.hpp"
#include "node/transport/websocket_frames.hpp"

namespace rrgate {

/// Whether the request asks to become a WebSocket at all.
bool asks_for_websocket(const HttpRequest& request);

/// Checks an upgrade: method, version, key and version of WebSockets, subprotocol if named (405, 426). nullopt: all is
/// well. Whose page it is for is checked before, see foreign_page.hpp.
std::optional<Response> refuse_upgrade(const HttpRequest& request,
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
