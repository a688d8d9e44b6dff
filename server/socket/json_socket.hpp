// The objects of a device as JSON messages over a WebSocket. Layer: server/socket. See docs/http-api.md.
#pragma once

#include <memory>
#include <string_view>

#include "server/http/request.hpp"
#include "server/state/gateway_state.hpp"

namespace rrgate {

inline constexpr std::string_view json_subprotocol = "rrgate.json.v1";

/// Whether an upgrade is for one: "/api/v1/devices/DEVICE/SERVICE" and objects below.
bool is_json_socket(const Request& request);

/// What a socket will be about. Errors   object_not_found, node_not_found: 404; those of percent-escapes.
struct JsonSocketPlace;
rr::Result<std::shared_ptr<JsonSocketPlace>> find_json_socket(GatewayState& gateway, const Request& request);

/// Serves it until either side ends it. `stream` has carried the 101 response.
rr::awaitable<void> serve_json_socket(GatewayState& gateway, Connection& connection,
                                      std::unique_ptr<rr::ByteStream> stream, std::shared_ptr<JsonSocketPlace> place);

}  // namespace rrgate
