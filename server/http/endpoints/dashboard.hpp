// The dashboard: files from web_root. Layer: server/http/endpoints.
#pragma once

#include "server/http/router.hpp"

namespace rrgate {

class GatewayState;

Handler dashboard_endpoint(GatewayState& gateway);

}  // namespace rrgate
