// A request to the gateway. Layer: server/http.
#pragma once

#include "node/http/message.hpp"
#include "server/access/identity.hpp"

namespace rrgate {

/// A request and who sent it.
struct Request : HttpRequest {
  Identity identity = {};  ///< of nobody until that was found out
};

}  // namespace rrgate
