// TCP: streams, listening, connecting. Layer: node/transport. Source: transports spec sections 1.3, 2 (socket
// options).
#pragma once

#include <boost/asio/ip/tcp.hpp>
#include <chrono>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "core/session/url.hpp"
#include "node/transport/byte_stream.hpp"

namespace rr {

/// `socket` as a stream, with TCP's options set.
std::unique_ptr<ByteStream> make_tcp_stream(boost::asio::ip::tcp::socket socket, std::chrono::milliseconds send_stall);

/// Accepts connections on the addresses that one host name or literal stands for.
class TcpListener {
 public:
  explicit TcpListener(const boost::asio::any_io_executor& executor) : executor_(executor) {}

  /// Binds and listens. Returns the addresses with their true ports (port 0 asks the system for one).
  /// Where the name stands for several, port 0 becomes the same port of all. `takes_both`: "::" takes IPv4 as well.
  /// Errors   connection_error: name unknown, address in use, not permitted.
  [[nodiscard]] Result<std::vector<HostPort>> open(const HostPort& address, bool takes_both = false);

  /// Calls `on_accept` for every connection until close(), and `on_problem` when one could not be accepted (no
  /// descriptors left, say); it goes on a little later then.
  using OnAccept = std::function<void(boost::asio::ip::tcp::socket)>;
  using OnProblem = std::function<void(const std::string& problem)>;
  void start(const OnAccept& on_accept, const OnProblem& on_problem);
  void close();

 private:
  using Acceptor = boost::asio::ip::tcp::acceptor;

  boost::asio::any_io_executor executor_;
  std::vector<std::shared_ptr<Acceptor>> acceptors_;
};

/// Connects to a host: all its addresses, IPv4 first, 5 ms apart and side by side; the first to connect wins. A
/// link-local IPv6 address without zone is tried in the zone of each interface.
/// Errors   connection_error with the cause of each address, or that `timeout` has passed.
awaitable<Result<boost::asio::ip::tcp::socket>> connect_tcp(std::string host, std::uint16_t port,
                                                            std::chrono::milliseconds timeout);

}  // namespace rr
