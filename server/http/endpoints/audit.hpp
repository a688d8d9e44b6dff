// The newest records of the audit log, for admins. Layer: server/http/endpoints.
#pragma once

#include "server/http/router.hpp"

namespace rrgate {

class GatewayState;

/// GET /api/v1/audit?user=PATTERN&device=PATTERN&limit=N, for admins: {"enabled","records": as they are in the file,
/// the newest first,"all": whether there are no older ones}. 409: the log is no file that can be read.
Handler audit_endpoint(GatewayState& gateway);

}  // namespace rrgate
