// rr+local: nodes of one machine over sockets of the file system. Layer: node/transport.
// Source: transports spec section 8.
#pragma once

#include <boost/asio/local/stream_protocol.hpp>
#include <functional>
#include <memory>
#include <optional>

#include "node/transport/dial.hpp"
#include "node/transport/local_files.hpp"

namespace rr {

/// Takes the connections of other programs of this user, or of all users that the administrator lets.
class LocalListener {
 public:
  explicit LocalListener(const boost::asio::any_io_executor& executor)
      : acceptor_(std::make_shared<Acceptor>(executor)) {}
  ~LocalListener() { close(); }

  /// Takes the node's ID and name among this user's nodes, opens its socket, and tells where it is. What nodes that
  /// crashed have left is cleaned up.
  /// Errors   system_resource_permission_denied: ID or name are in use; system_resource_error, also where
  ///          the machine is not set up for public nodes.
  [[nodiscard]] Result<> open(const NodeIdentity& node, std::string nonce, bool is_public = false);
  /// As TcpListener::start().
  using OnAccept = std::function<void(std::unique_ptr<ByteStream>)>;
  using OnProblem = std::function<void(const std::string& problem)>;
  void start(OnAccept on_accept, OnProblem on_problem, std::chrono::milliseconds send_stall);
  /// The services have changed: who watches the files asks again.
  [[nodiscard]] Result<> publish(std::string nonce);
  void close();

 private:
  using Acceptor = boost::asio::local::stream_protocol::acceptor;

  std::shared_ptr<Acceptor> acceptor_;
  std::optional<LocalNodeFiles> files_;
  LocalNodeInfo info_;
};

/// Looks the node up and connects. The socket must belong to the user who is expected there, or to root.
/// Errors   node_not_found; connection_error with the cause for each place that knows the node.
awaitable<Result<std::unique_ptr<ByteStream>>> dial_local(ConnectionUrl url, DialOptions options);

}  // namespace rr
