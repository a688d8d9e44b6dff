// /metrics: counters for Prometheus. Layer: server/http/endpoints. Source: its text exposition format, version 0.0.4.
#pragma once

#include "server/http/router.hpp"

namespace rrgate {

class GatewayState;

/// Labels are the names of devices, of which there are as many as the configuration, discover.max_devices and
/// serve.max_devices allow, and words that are listed in metrics.hpp.
Handler metrics_endpoint(GatewayState& gateway);

}  // namespace rrgate
