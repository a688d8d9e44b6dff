// One port for all: tells raw Robot Raconteur, HTTP and TLS apart by the first bytes. Layer: server/front.
// Source: transports spec section 4.1.
#pragma once

#include <boost/asio/ip/tcp.hpp>
#include <memory>
#include <span>

#include "node/transport/byte_stream.hpp"
#include "server/state/admission.hpp"

namespace rrgate {

class GatewayState;

enum class Protocol {
  undecided,  ///< more bytes needed
  robot_raconteur,
  http,
  tls,  ///< a ClientHello; one of the others follows inside
  unknown,
};

/// What the first bytes of a connection say. Decides as early as it can, with four bytes at the latest.
Protocol detect_protocol(rr::ByteSpan first_bytes);

/// Serves one accepted connection to its end.
rr::awaitable<void> serve_connection(GatewayState& gateway, std::unique_ptr<rr::ByteStream> stream,
                                     boost::asio::ip::tcp::endpoint peer, boost::asio::ip::tcp::endpoint local,
                                     Admission::Ticket ticket);

}  // namespace rrgate
