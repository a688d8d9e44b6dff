// The Model Context Protocol: devices for agents, by JSON-RPC in requests of HTTP. Layer: server/mcp. See docs/mcp.md.
// Source: modelcontextprotocol.io, revisions 2025-06-18 to 2026-07-28, "Streamable HTTP".
#pragma once

#include <string_view>

#include "server/http/router.hpp"
#include "server/state/agent_login.hpp"

namespace rrgate {

class GatewayState;

/// Answers one message of a client. Of revisions that begin with "initialize", what a session has subscribed to is kept
/// between two of them, and nothing else.
Handler mcp_endpoint(GatewayState& gateway);
/// The client's session is over: what it still waits for is cancelled.
Handler end_mcp_endpoint(GatewayState& gateway);
/// Whether a request may stop something: by the tool "stop", or because a session or a request of it ends. Of a message
/// its body tells, and mcp_endpoint() refuses all others that are too much (Request::too_much), or have no room.
bool may_stop_something(const Request& request);

/// Which issuer's tokens clients show at mcp_path, where one is configured. Source: RFC 9728.
Handler mcp_metadata_endpoint(GatewayState& gateway);
/// What a session is told of without a request, in revisions that begin with "initialize".
Handler mcp_stream_endpoint(GatewayState& gateway);

}  // namespace rrgate
