// Who sent the request that a handler works on. Layer: node.
#pragma once

#include <cstdint>
#include <string>

#include "core/session/connection.hpp"

namespace rr {

/// One client of a node, for as long as it is connected; never 0, never used again.
using ClientId = std::uint64_t;

struct Caller {
  ClientId id = 0;             ///< 0: there is none
  std::string user = {};       ///< the name it has logged in by; empty while it has not
  std::uint32_t endpoint = 0;  ///< the service's number of the session, as the reference names clients
  NodeIdentity node = {};      ///< as the client says
  NodeId verified_node = {};   ///< as its certificate proves; any: nobody vouches for it
};

}  // namespace rr
