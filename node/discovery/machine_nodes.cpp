#include "node/discovery/machine_nodes.hpp"

#include <algorithm>

namespace rr {

namespace {

constexpr std::chrono::milliseconds hardware_refresh{30'000};

}  // namespace

MachineNodes::MachineNodes(const boost::asio::any_io_executor& executor, const MachineNodesOptions& options,
                           Callbacks callbacks)
    : callbacks_(std::move(callbacks)) {
  if (options.intra) {
    auto found = [this](const std::vector<IntraNode>& nodes) {
      std::vector<Announcement> news;
      for (const auto& [node, url, nonce] : nodes) news.push_back({node.id, node.name, url, nonce});
      tell(intra_nodes_, news);
    };
    intra_.emplace(executor, std::move(found), options.refresh);
  }
  if (options.local) {
    auto found = [this](const std::vector<LocalNode>& nodes) {
      std::vector<Announcement> news;
      for (const auto& [info, url] : nodes) news.push_back({info.node.id, info.node.name, url, info.nonce});
      tell(local_nodes_, news);
    };
    auto failed = [this](const std::string& problem) { callbacks_.report("nodes of this machine: " + problem); };
    local_.emplace(executor, std::move(found), std::move(failed), options.refresh);
  }
  if (options.hardware) {
    auto found = [this](const std::vector<HardwareNode>& nodes) {
      std::vector<Announcement> news;
      for (const auto& node : nodes)
        if (!node.id.is_any()) news.push_back({node.id, node.name, node.url, ""});  // others can be dialed by name
      tell(hardware_nodes_, news);
    };
    auto failed = [this](const std::string& problem) { callbacks_.report("plugged-in nodes: " + problem); };
    hardware_.emplace(executor, std::move(found), std::move(failed), std::min(hardware_refresh, options.refresh),
                      *options.hardware);
  }
}

void MachineNodes::refresh() {
  if (intra_) intra_->refresh();
  if (local_) local_->refresh();
}

void MachineNodes::tell(Told& before, const std::vector<Announcement>& nodes) {
  Told now;
  for (const auto& node : nodes)
    if (!callbacks_.is_own(node.node_id)) now.emplace(node.node_id, node.url);
  const auto gone = std::exchange(before, now);
  for (const auto& [id, url] : gone)
    if (!now.contains({id, url})) callbacks_.withdrawn(id, url);
  for (const auto& node : nodes)
    if (now.contains({node.node_id, node.url})) callbacks_.announced(node);
}

}  // namespace rr
