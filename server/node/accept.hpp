// From a TCP connection to the stream of a session: which protocol the peer speaks, and WebSockets' upgrade. Layer:
// node. Source: transports spec sections 4.1 and 4.2.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "server/transport/byte_stream.hpp"

namespace rr {

struct AcceptOptions {
  /// Pages that may open WebSockets: scheme://host[:port], scheme://*.domain[:port]; a page from the same host and port
  /// always may, and so may whoever sends no Origin.
  std::vector<std::string> allowed_origins = {};
};

struct Accepted {
  std::unique_ptr<ByteStream> stream;
  std::string scheme;  ///< of the URL that the client may have used: "rr+tcp", "rr+ws"
};

/// Reads the first bytes: a Robot Raconteur stream goes on as it is, a WebSocket is upgraded, everything else is
/// refused with 404. All within 5 s.
/// Errors   connection_error: the peer has gone, was refused, or took too long; the stream is closed.
awaitable<Result<Accepted>> accept_stream(std::unique_ptr<ByteStream> stream, AcceptOptions options);

}  // namespace rr
