// /api/v1/discovery: nodes on the local network. Layer: server/http/endpoints.
#pragma once

#include "server/http/router.hpp"

namespace rrgate {

class GatewayState;

/// {"enabled","nodes":[{"node_id","node_name","urls":[{"url","age"}],"age","services","allowed","device"}]}; ages in
/// seconds since the last announcement; services [{"name","type"}], null where they are not known; device the name of
/// the device that the node is, or null.
Handler discovery_endpoint(GatewayState& gateway);

}  // namespace rrgate
