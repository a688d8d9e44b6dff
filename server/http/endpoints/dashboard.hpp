// The dashboard: files from web_root. Layer: server/http.
#pragma once

#include "server/http/router.hpp"

namespace rrgate {

class Gateway;

Handler dashboard_endpoint(Gateway& gateway);

}  // namespace rrgate
