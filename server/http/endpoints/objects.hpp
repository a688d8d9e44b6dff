// The objects of devices over HTTP: GET, PUT, POST and streams. Layer: server/http. See docs/http-api.md.
#pragma once

#include "server/gateway/gateway.hpp"
#include "server/http/router.hpp"

namespace rrgate {

/// "DEVICE", "DEVICE/SERVICE" and what is below, for all methods.
Handler objects_endpoint(Gateway& gateway);

}  // namespace rrgate
