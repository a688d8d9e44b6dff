// A client that may not have the device that it asks for hears so in a session, as a node would say it. Layer:
// server/gateway. Source: sessions spec section 2.3.
#pragma once

#include <memory>

#include "server/gateway/device.hpp"
#include "server/gateway/gateway.hpp"
#include "server/transport/byte_stream.hpp"

namespace rrgate {

/// Answers the handshake in the device's place, and the first request for a service with `refusal`; nobody connects to
/// the device. Ends then, and in any case after limits.header_timeout. `client` is at the start of its Robot Raconteur
/// stream.
rr::awaitable<void> refuse_in_session(Gateway& gateway, Connection& connection, const Device& device,
                                      std::unique_ptr<rr::ByteStream> client, rr::Error refusal);

}  // namespace rrgate
