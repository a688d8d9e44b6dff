// A client that may not have the device that it asks for hears so in a session, as a node would say it. Layer:
// server/front. Source: sessions spec section 2.3.
#pragma once

#include <memory>

#include "node/transport/byte_stream.hpp"
#include "server/state/gateway_state.hpp"
#include "server/upstream/device.hpp"

namespace rrgate {

/// The node that a client has asked for, there or not: who may see nothing is not told which it is.
rr::NodeIdentity unknown_identity(GatewayState& gateway, const rr::NodeId& asked_id, std::string_view asked_name);

/// Who the client of a relayed device believes to talk to: else it would not listen.
rr::NodeIdentity relayed_identity(GatewayState& gateway, const Device& device);

/// Answers the handshake as the node `self`, and the first request for a service with `refusal`; nobody connects to the
/// device. Ends then, and in any case after limits.header_timeout. `client` is at the start of its Robot Raconteur
/// stream.
rr::awaitable<void> refuse_in_session(GatewayState& gateway, Connection& connection, rr::NodeIdentity self,
                                      std::unique_ptr<rr::ByteStream> client, rr::Error refusal);

}  // namespace rrgate
