// What a person says to agents: yes, no, stop. Layer: server/http/endpoints. See docs/mcp.md.
#pragma once

#include "server/http/router.hpp"

namespace rrgate {

class GatewayState;

/// GET /api/v1/agents/approvals, for admins: {"approvals": [{"id", "user", "client", "device", "path", "member",
/// "verb", "values", "why", "expires_in"}], "stopped_for": seconds}.
Handler approvals_endpoint(GatewayState& gateway);
/// POST /api/v1/agents/approvals/ID {"answer": "once", "minutes" or "deny", "minutes": N}, for admins: {"state"}.
Handler approval_endpoint(GatewayState& gateway);
/// GET /api/v1/agents/sessions, for admins: {"sessions": [{"user", "client", "program", "begun_ago", "used_ago",
/// "ended", "reads", "commands", "last_commands": [{"ago", "tool", "device", "path", "values", "state", "detail"}]}]}.
Handler agent_sessions_endpoint(GatewayState& gateway);
/// POST /api/v1/agents/stop {"minutes": N}, for admins: {"ended": commands, "stopped_for": seconds, "devices":
/// [{"device", and what stop_to_json() gives}]}. 0 minutes: what goes on ends, and agents may go on.
Handler stop_agents_endpoint(GatewayState& gateway);

}  // namespace rrgate
