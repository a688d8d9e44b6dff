// Native clients (rr+tcp): their first message says which node they want. Layer: server/front.
// Source: transports spec section 3.1.
#pragma once

#include <memory>

#include "core/wire/message.hpp"
#include "server/state/gateway_state.hpp"

namespace rrgate {

/// Reads the first message and routes by its ReceiverNodeID and ReceiverNodeName. A client that asks for a node that
/// isn't here, or is down, gets the error reply a node would send.
/// Returns  what serves the client then; not valid() where it was refused.
rr::awaitable<rr::awaitable<void>> serve_native_client(GatewayState& gateway, Connection& connection,
                                                       std::unique_ptr<rr::ByteStream> stream);

/// The reply to a first message that reaches no device.
rr::Bytes make_refusal(const rr::Message& request, const rr::NodeId& own_id, const rr::Error& error);

}  // namespace rrgate
