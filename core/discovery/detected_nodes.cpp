#include "core/discovery/detected_nodes.hpp"

#include <algorithm>

namespace rr {

void DetectedNodes::handle_announcement(const Announcement& announcement, Now now, std::string_view sender) {
  const NodeDiscoveryUrl heard{announcement.url, now.steady};
  const auto expiry = now.steady + options_.expiry;
  next_expiry_ = std::min(next_expiry_.value_or(expiry), expiry);

  const auto found = nodes_.find(announcement.node_id);
  if (found == nodes_.end()) {
    if (!make_room(std::string(sender))) return;
    const NodeDiscoveryInfo info{
        announcement.node_id, announcement.node_name, {heard}, announcement.service_state_nonce};
    nodes_.emplace(announcement.node_id, info);
    if (!sender.empty()) claim(announcement.node_id, std::string(sender));
    events_.push_back({NodeEvent::Kind::found, info});
    return;
  }

  if (const auto owner = end_claim(announcement.node_id); owner && !sender.empty()) claim(announcement.node_id, *owner);
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
  node.node_name = announcement.node_name;
  // Not every way to a node tells a nonce: USB does not. That says nothing of its services.
  const auto& nonce = announcement.service_state_nonce;
  event.nonce_changed = !nonce.empty() && node.service_state_nonce != nonce;
  if (event.nonce_changed) node.service_state_nonce = nonce;
  if (!event.urls_changed && !event.name_changed && !event.nonce_changed) return;
  event.node = node;
  events_.push_back(std::move(event));
}

bool DetectedNodes::make_room(const std::string& sender) {
  if (const auto own = claims_by_sender_.find(sender);
      own != claims_by_sender_.end() && own->second.size() >= options_.max_nodes_of_sender) {
    give_up(own->second.begin()->second);
  } else if (nodes_.size() >= options_.max_nodes) {
    if (claims_by_turn_.empty()) return false;
    give_up(claims_by_turn_.begin()->second);
  }
  return true;
}

void DetectedNodes::give_up(const NodeId& node_id) {
  const auto node = nodes_.extract(node_id);
  end_claim(node.key());
  events_.push_back({NodeEvent::Kind::lost, node.mapped()});
}

void DetectedNodes::claim(const NodeId& node_id, const std::string& sender) {
  const auto turn = ++last_turn_;
  claims_[node_id] = {turn, sender};
  claims_by_turn_[turn] = node_id;
  claims_by_sender_[sender][turn] = node_id;
}

std::optional<std::string> DetectedNodes::end_claim(const NodeId& node_id) {
  const auto ended = claims_.extract(node_id);
  if (!ended) return std::nullopt;
  const auto& [turn, sender] = ended.mapped();
  claims_by_turn_.erase(turn);
  const auto own = claims_by_sender_.find(sender);
  own->second.erase(turn);
  if (own->second.empty()) claims_by_sender_.erase(own);
  return sender;
}

void DetectedNodes::confirm(const NodeId& node_id) {
  end_claim(node_id);
}

template <class F>
DetectedNodes::Nodes::iterator DetectedNodes::drop_urls(Nodes::iterator node, F&& is_gone) {
  auto& info = node->second;
  if (std::none_of(info.urls.begin(), info.urls.end(), is_gone)) return std::next(node);
  const auto last = info;  // what a lost node was
  info.urls.erase(std::remove_if(info.urls.begin(), info.urls.end(), is_gone), info.urls.end());
  if (info.urls.empty()) {
    events_.push_back({NodeEvent::Kind::lost, last});
    end_claim(node->first);
    return nodes_.erase(node);
  }
  NodeEvent event{NodeEvent::Kind::changed, info};
  event.urls_changed = true;
  events_.push_back(std::move(event));
  return std::next(node);
}

void DetectedNodes::handle_withdrawn(const NodeId& node_id, std::string_view url) {
  const auto node = nodes_.find(node_id);
  if (node != nodes_.end()) drop_urls(node, [url](const auto& each) { return each.url == url; });
}

void DetectedNodes::forget(const NodeId& node_id) {
  const auto node = nodes_.find(node_id);
  if (node != nodes_.end()) drop_urls(node, [](const auto&) { return true; });
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
