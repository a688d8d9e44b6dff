// A request to the gateway. Layer: server/http.
#pragma once

#include "node/http/message.hpp"
#include "server/access/identity.hpp"
#include "server/limits/client_network.hpp"

namespace rrgate {

/// A request and who sent it.
struct Request : HttpRequest {
  Identity identity = {};  ///< of nobody until that was found out

  ClientOrigin origin() const { return {arrival.peer, network_name(arrival.address)}; }
};

}  // namespace rrgate
