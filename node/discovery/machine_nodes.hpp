// Nodes that are found without packets: those of this process and this machine, and those that are plugged into it.
// Layer: node/discovery. Source: transports spec section 8.5; hardware spec.
#pragma once

#include <boost/asio/any_io_executor.hpp>
#include <chrono>
#include <functional>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "core/discovery/announcement.hpp"
#include "node/transport/hardware.hpp"
#include "node/transport/intra.hpp"
#include "node/transport/local_watch.hpp"

namespace rr {

struct MachineNodesOptions {
  bool intra = true;
  bool local = true;
  std::optional<DriverRoots> hardware = DriverRoots{};  ///< nullopt: none
  std::chrono::milliseconds refresh{55'000};            ///< every node is told of again at least so often
};

/// For the thread of its executor; may be destroyed at any time but in its own callbacks.
class MachineNodes {
 public:
  struct Callbacks {
    std::function<bool(const NodeId& id)> is_own;  ///< nodes to pass over
    std::function<void(const Announcement& announcement)> announced;
    std::function<void(const NodeId& id, const std::string& url)> withdrawn;
    std::function<void(const std::string& problem)> report;
  };
  MachineNodes(const boost::asio::any_io_executor& executor, const MachineNodesOptions& options, Callbacks callbacks);
  MachineNodes(const MachineNodes&) = delete;
  MachineNodes& operator=(const MachineNodes&) = delete;

  /// Looks again soon.
  void refresh();

 private:
  /// What one source has told last.
  using Told = std::set<std::pair<NodeId, std::string>>;
  void tell(Told& before, const std::vector<Announcement>& nodes);

  Callbacks callbacks_;
  Told intra_nodes_;
  Told local_nodes_;
  Told hardware_nodes_;
  std::optional<IntraWatch> intra_;
  std::optional<LocalWatch> local_;
  std::optional<HardwareWatch> hardware_;
};

}  // namespace rr
