// From a TCP connection to the stream of a session: which protocol the peer speaks, and WebSockets' upgrade. Layer:
// node/driver. Source: transports spec sections 4.1 and 4.2.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "core/session/connection.hpp"
#include "node/tls/tls_context.hpp"
#include "node/transport/byte_stream.hpp"

namespace rr {

struct AcceptOptions {
  /// Pages that may open WebSockets: scheme://host[:port], scheme://*.domain[:port]. A page from the same host and port
  /// may where the host is an IP address or localhost, and so may whoever sends no Origin.
  std::vector<std::string> allowed_origins = {};
  NodeIdentity self = {};     ///< for TLS: who is meant
  TlsContextPtr tls = {};     ///< null: clients that ask for TLS are told that there is no certificate
  bool requires_tls = false;  ///< clients that don't ask for it are refused
};

struct Accepted {
  std::unique_ptr<ByteStream> stream;
  std::string scheme;         ///< of the URL that the client may have used: "rr+tcp", "rr+ws", "rrs+tcp", "rrs+ws"
  NodeId known_peer = {};     ///< who the client must go on saying to be; any: it has not said yet
  bool is_encrypted = false;  ///< by TLS; who it has proved to be is the stream's verified_peer()
};

/// Reads the first bytes: a Robot Raconteur stream goes on as it is, a WebSocket is upgraded, everything else is
/// refused with 404. Inside of either the client may start TLS. Each step within 5 s.
/// Errors   connection_error: the peer has gone, was refused, or took too long; those of accept_tls(). The stream is
///          closed.
awaitable<Result<Accepted>> accept_stream(std::unique_ptr<ByteStream> stream, AcceptOptions options);

}  // namespace rr
