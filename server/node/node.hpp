// A native node: listens, dials, and runs services and clients on one thread. Layer: node.
#pragma once

#include <boost/asio/io_context.hpp>
#include <chrono>
#include <functional>
#include <memory>
#include <string>
#include <string_view>

#include "server/node/service.hpp"

namespace rr {

struct NodeOptions {
  NodeId id = {};  ///< any: random
  Features features = {};
  std::size_t max_message_size = 12u * 1024 * 1024;
};

/// A node on one thread: everything runs in run(), handlers included. Other threads use post().
class Node {
 public:
  /// `name` may be empty.
  explicit Node(std::string name, NodeOptions options = {});
  /// Runs on somebody else's io_context; run() and stop() then are theirs.
  Node(boost::asio::io_context& io, std::string name, NodeOptions options = {});
  ~Node();

  /// Throws   std::invalid_argument that names the handler that does not fit.
  void add(const std::shared_ptr<Service>& service);
  /// "rr+tcp://0.0.0.0:52222", "rr+tcp://[::]:0"; port 0 takes a free one.
  /// Returns  the port. Throws std::system_error ("listen on rr+tcp://...: Address already in use").
  std::uint16_t listen(std::string_view url);

  /// Runs until stop(), SIGINT or SIGTERM.
  void run();
  void stop();
  /// Runs `work` on the node's thread.
  void post(std::function<void()> work);
  /// Runs `work` again and again, `period` apart, without drift; for the node's lifetime.
  void every(std::chrono::nanoseconds period, std::function<void()> work);

  const NodeIdentity& identity() const;
  boost::asio::io_context& io_context();
  /// Clients connected now.
  std::size_t client_count() const;

 private:
  friend class Object;
  class Implementation;
  std::unique_ptr<Implementation> implementation_;
};

}  // namespace rr
