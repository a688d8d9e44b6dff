// The one list of transports that reach a device, by URL scheme. Layer: server/transport.
#pragma once

#include <chrono>
#include <memory>

#include "server/transport/byte_stream.hpp"
#include "server/transport/http_connect.hpp"
#include "server/transport/schemes.hpp"

namespace rr {

struct DialOptions {
  std::chrono::milliseconds timeout{5000};
  std::chrono::milliseconds send_stall{15000};
  /// An HTTP proxy between here and hosts of the TCP family, asked by CONNECT; empty host: none.
  HostPort proxy = {};
  /// For the HTTP request of a WebSocket: a token that a gateway wants, say.
  HttpHeaders headers = {};
};

/// Connects to the device of `url`; nothing is sent.
/// Errors   connection_error: not reached in time, refused, or a scheme that isn't in the list.
awaitable<Result<std::unique_ptr<ByteStream>>> dial(ConnectionUrl url, DialOptions options);

}  // namespace rr
