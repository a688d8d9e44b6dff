// rr+intra: nodes of one process, for tests and simulations. Layer: node/transport.
// Source: transports spec section 9.
//
// The reference passes message objects by reference; here a socket pair carries the bytes of the ordinary protocol, so
// that everything above is the same as everywhere, and each node may have a thread of its own.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "core/session/connection.hpp"
#include "node/transport/dial.hpp"

namespace rr {

/// A node of this process that listens.
struct IntraNode {
  NodeIdentity node;
  std::string url;    ///< of its service index
  std::string nonce;  ///< ServiceStateNonce
};

/// Takes the connections of this process. For the thread of its executor.
class IntraListener {
 public:
  using OnAccept = std::function<void(std::unique_ptr<ByteStream>)>;
  IntraListener(const boost::asio::any_io_executor& executor, OnAccept on_accept, std::chrono::milliseconds send_stall);
  ~IntraListener() { close(); }
  IntraListener(const IntraListener&) = delete;
  IntraListener& operator=(const IntraListener&) = delete;

  /// Errors   system_resource_permission_denied: another node of this process has the ID.
  [[nodiscard]] Result<> open(const NodeIdentity& node, std::string nonce);
  /// The services have changed.
  void publish(std::string nonce);
  /// No connection any more from here on.
  void close();

  struct Place;

 private:
  std::shared_ptr<Place> place_;
};

/// Errors   node_not_found; system_resource_error: no socket pair.
awaitable<Result<std::unique_ptr<ByteStream>>> dial_intra(ConnectionUrl url, DialOptions options);

/// Hands the list of this process's nodes to `on_nodes`: soon, after every change, and every `refresh`. For the
/// executor's thread.
class IntraWatch {
 public:
  using OnNodes = std::function<void(const std::vector<IntraNode>&)>;
  IntraWatch(const boost::asio::any_io_executor& executor, OnNodes on_nodes, std::chrono::milliseconds refresh);
  /// No call any more from here on.
  ~IntraWatch();
  IntraWatch(const IntraWatch&) = delete;
  IntraWatch& operator=(const IntraWatch&) = delete;

  void refresh();

  struct State;

 private:
  std::shared_ptr<State> state_;
};

}  // namespace rr
