#include "core/discovery/detected_nodes.hpp"

#include <algorithm>

namespace rr {

void DetectedNodes::handle_announcement(const Announcement& announcement, Now now) {
  const NodeDiscoveryUrl heard{announcement.url, now.steady, now.utc};
  const auto expiry = now.steady + options_.expiry;
  next_expiry_ = std::min(next_expiry_.value_or(expiry), expiry);

  const auto found = nodes_.find(announcement.node_id);
  if (found == nodes_.end()) {
    if (nodes_.size() >= options_.max_nodes) return;
    const NodeDiscoveryInfo info{
        announcement.node_id, announcement.node_name, {heard}, announcement.service_state_nonce};
    nodes_.emplace(announcement.node_id, info);
    events_.push_back({NodeEvent::Kind::found, info});
    return;
  }

  auto& node = found->second;
  NodeEvent event{NodeEvent::Kind::changed, {}};
  const auto known =
      std::find_if(node.urls.begin(), node.urls.end(), [&](const auto& url) { return url.url == heard.url; });
  if (known != node.urls.end()) {
    *known = heard;
  } else {
    event.urls_changed = true;
    if (node.urls.size() >= options_.max_urls)
      node.urls.erase(std::min_element(node.urls.begin(), node.urls.end(),
                                       [](const auto& a, const auto& b) { return a.last_announce < b.last_announce; }));
    node.urls.push_back(heard);
  }
  event.name_changed = node.node_name != announcement.node_name;
  event.nonce_changed = node.service_state_nonce != announcement.service_state_nonce;
  node.node_name = announcement.node_name;
  node.service_state_nonce = announcement.service_state_nonce;
  if (!event.urls_changed && !event.name_changed && !event.nonce_changed) return;
  event.node = node;
  events_.push_back(std::move(event));
}

template <class F>
DetectedNodes::Nodes::iterator DetectedNodes::drop_urls(Nodes::iterator node, F&& is_gone) {
  auto& info = node->second;
  const auto last = info;  // what a lost node was
  info.urls.erase(std::remove_if(info.urls.begin(), info.urls.end(), is_gone), info.urls.end());
  if (info.urls.empty()) {
    events_.push_back({NodeEvent::Kind::lost, last});
    return nodes_.erase(node);
  }
  if (info.urls.size() != last.urls.size()) {
    NodeEvent event{NodeEvent::Kind::changed, info};
    event.urls_changed = true;
    events_.push_back(std::move(event));
  }
  return std::next(node);
}

void DetectedNodes::handle_withdrawn(const NodeId& node_id, std::string_view url) {
  const auto node = nodes_.find(node_id);
  if (node != nodes_.end()) drop_urls(node, [url](const auto& each) { return each.url == url; });
}

void DetectedNodes::handle_timeout(Now now) {
  if (!next_expiry_ || now.steady < *next_expiry_) return;
  next_expiry_.reset();
  for (auto node = nodes_.begin(); node != nodes_.end();)
    node = drop_urls(node, [&](const auto& url) { return url.last_announce + options_.expiry <= now.steady; });
  for (const auto& [id, node] : nodes_)
    for (const auto& url : node.urls) {
      const auto expiry = url.last_announce + options_.expiry;
      next_expiry_ = std::min(next_expiry_.value_or(expiry), expiry);
    }
}

std::optional<NodeEvent> DetectedNodes::poll_event() {
  if (events_.empty()) return std::nullopt;
  auto event = std::move(events_.front());
  events_.pop_front();
  return event;
}

}  // namespace rr
