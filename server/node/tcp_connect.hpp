// Dials a host: all its addresses, side by side. Layer: node.
#pragma once

#include <boost/asio/ip/tcp.hpp>
#include <chrono>
#include <functional>
#include <string>

#include "core/support/error.hpp"

namespace rr {

using TcpConnected = std::function<void(Result<boost::asio::ip::tcp::socket>)>;

/// Resolves `host` and connects to whichever of its addresses answers first; each next one is tried 250 ms after the
/// one before it, or as soon as that one failed, IPv6 and IPv4 in turns (RFC 8305). `done` is called once, never from
/// in here. Errors   connection_error that names host, port and the last failure; request_timeout.
void tcp_connect(boost::asio::io_context& io, const std::string& host, std::uint16_t port,
                 std::chrono::milliseconds timeout, TcpConnected done);

}  // namespace rr
