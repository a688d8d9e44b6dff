// A request to the gateway. Layer: server/http.
#pragma once

#include <string>

#include "node/http/message.hpp"
#include "server/access/identity.hpp"
#include "server/limits/client_network.hpp"

namespace rrgate {

/// A request and who sent it.
struct Request : HttpRequest {
  Identity identity = {};  ///< of nobody until that was found out, but for the face
  /// What it is too much of, "from 192.0.2.1", where it came through all the same: it may be urgent. Empty: it is not.
  std::string too_much = {};

  ClientOrigin origin() const { return {arrival.peer, network_name(arrival.address), identity.face}; }
};

}  // namespace rrgate
