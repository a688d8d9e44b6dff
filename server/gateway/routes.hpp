// The list of everything that HTTP answers. Layer: server/gateway.
#pragma once

#include "server/http/router.hpp"

namespace rrgate {

class GatewayState;

struct Route {
  http::verb method;
  std::string pattern;  ///< see Router::add()
  Handler handler;
};

/// In the order in which they are tried. The handlers refer to the gateway, which outlives them.
std::vector<Route> list_routes(GatewayState& gateway);

Router make_routes(GatewayState& gateway);

}  // namespace rrgate
