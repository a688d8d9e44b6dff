// /healthz: the process answers. /readyz: it takes clients. Layer: server/http/endpoints.
#pragma once

#include "server/http/router.hpp"

namespace rrgate {

class GatewayState;

Handler health_endpoint();
/// 503 once the gateway is stopping. Devices that are down don't make it unready: they are its news, not its failure.
Handler ready_endpoint(GatewayState& gateway);

}  // namespace rrgate
