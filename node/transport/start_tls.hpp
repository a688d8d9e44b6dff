// STARTTLS on a stream that no session has yet. Layer: node/transport. Source: transports spec section 5.1.
#pragma once

#include <chrono>
#include <memory>

#include "core/session/connection.hpp"
#include "node/tls/tls_context.hpp"
#include "node/transport/byte_stream.hpp"

namespace rr {

/// The client's side: asks for TLS, checks that the peer is `target` (any node, where it names none) and has proved it.
/// Returns  the stream for the session, whose verified_peer() is that node.
/// Errors   as read_start_tls_reply() and TlsStream::handshake(); connection_error: nothing came within `timeout`.
awaitable<Result<std::unique_ptr<ByteStream>>> start_tls_client(std::unique_ptr<ByteStream> stream, NodeIdentity target,
                                                                TlsContextPtr context,
                                                                std::chrono::milliseconds timeout);

struct AcceptTlsOptions {
  NodeIdentity self = {};
  TlsContextPtr context = {};               ///< null: STARTTLS is refused ("Server certificate not loaded")
  bool is_required = false;                 ///< clients that don't ask for TLS are refused
  std::chrono::milliseconds timeout{5000};  ///< for the first message, and for the handshake
};
struct AcceptedStream {
  std::unique_ptr<ByteStream> stream;
  NodeId claimed = {};  ///< what the client said to be when it asked for TLS, to be said again within; any: nothing
  bool is_encrypted = false;
};

/// The service's side: reads the first message. STARTTLS is answered and carried out, GetRemoteNodeID is answered and
/// the next message is the first; anything else, and what is no message, is put back for the session.
/// Errors   connection_error: ended, or nothing within the time; a client that was refused; authentication_error: its
///          certificate is refused. There is nothing left to do then.
awaitable<Result<AcceptedStream>> accept_tls(std::unique_ptr<ByteStream> stream, AcceptTlsOptions options);

}  // namespace rr
