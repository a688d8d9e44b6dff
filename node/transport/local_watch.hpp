// Watches the folders in which nodes of this machine leave their info files. Layer: node/transport.
// Source: transports spec section 8.5.
#pragma once

#include <boost/asio/any_io_executor.hpp>
#include <chrono>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "node/transport/byte_stream.hpp"
#include "node/transport/local_files.hpp"

namespace rr {

/// A node that runs on this machine.
struct LocalNode {
  LocalNodeInfo info;
  std::string url;  ///< of the node's service index
};

/// This user's nodes and the public ones of all users.
/// Errors   those of all_local_bases() and of a base's list.
[[nodiscard]] Result<std::vector<LocalNode>> list_local_nodes();

/// Hands the list of nodes to `on_nodes`: soon, shortly after files have changed or a node has let go of them, and
/// every `refresh`; where the list can't be made, none, and `on_problem` hears why. What the system does not tell, or
/// tells of too many folders, the refresh sees. For the executor's thread.
class LocalWatch {
 public:
  using OnNodes = std::function<void(const std::vector<LocalNode>&)>;
  using OnProblem = std::function<void(const std::string& problem)>;
  LocalWatch(const boost::asio::any_io_executor& executor, OnNodes on_nodes, OnProblem on_problem,
             std::chrono::milliseconds refresh = std::chrono::seconds(55));
  /// No call any more from here on.
  ~LocalWatch();
  LocalWatch(const LocalWatch&) = delete;
  LocalWatch& operator=(const LocalWatch&) = delete;

  /// Looks again soon.
  void refresh();

 private:
  struct State;
  static awaitable<void> run(std::shared_ptr<State> state);
  static awaitable<void> listen(std::shared_ptr<State> state);
  std::shared_ptr<State> state_;
};

}  // namespace rr
