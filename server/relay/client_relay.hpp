// A client that has found its device: seat, connection, relay, and the log line at its end. Layer: server/relay.
#pragma once

#include <memory>

#include "node/transport/byte_stream.hpp"
#include "server/state/gateway_state.hpp"
#include "server/upstream/device.hpp"

namespace rrgate {

/// A place at a device and a connection to it.
struct Boarding {
  Device& device;
  Device::Seat seat;
  std::unique_ptr<rr::ByteStream> stream;
  std::shared_ptr<const void> session = device.begin_session();
};

/// Whether a client's bytes may pass to a device unread: only where he could do everything to it.
/// `device`  null: there is none, and the client, who may see nothing, is refused all the same.
/// Errors   permission_denied; the text is for the client. Who may see nothing gets the same for every device.
rr::Result<> may_relay(GatewayState& gateway, const Connection& connection, const Device* device);

/// `way`    see Device::connect().
/// Errors   connection_error: the device is full or can't be reached; the text is for the client.
rr::awaitable<rr::Result<std::unique_ptr<Boarding>>> board(GatewayState& gateway, const Connection& connection,
                                                           Device& device, std::string way = {});

/// Relays until one side ends; ends both. `client` is at the start of its Robot Raconteur stream.
rr::awaitable<void> relay_client(GatewayState& gateway, Connection& connection, std::unique_ptr<rr::ByteStream> client,
                                 std::unique_ptr<Boarding> boarding);

}  // namespace rrgate
