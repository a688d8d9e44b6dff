// The list of everything that HTTP answers. Layer: server/http.
#pragma once

#include "server/http/router.hpp"

namespace rrgate {

class Gateway;

/// The handlers refer to the gateway, which outlives them.
Router make_routes(Gateway& gateway);

}  // namespace rrgate
