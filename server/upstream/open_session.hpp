// A session of the gateway's with a service of a device. Layer: server/upstream.
#pragma once

#include <memory>
#include <string>

#include "node/client/client_connection.hpp"
#include "server/upstream/device.hpp"

namespace rrgate {

/// Opens a session with `service` on a stream to the device. `username` empty: without a login.
/// `is_stepwise`  as old clients do, which services admit before anybody has logged in.
/// Errors   those of ClientConnection::open().
rr::awaitable<rr::Result<std::shared_ptr<rr::ClientConnection>>> open_session(
    std::unique_ptr<rr::ByteStream> stream, const std::string& service, const rr::NodeIdentity& target,
    const std::string& username, const rr::MapString& credentials, bool is_stepwise = false);

}  // namespace rrgate
