// The nodes that were heard of lately, from whatever source. Layer: discovery. Source: transports spec
// sections 6.2..6.4.
#pragma once

#include <chrono>
#include <deque>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/discovery/announcement.hpp"
#include "core/support/time.hpp"

namespace rr {

/// One way to a node, and when it was announced last.
struct NodeDiscoveryUrl {
  std::string url;  ///< of the service index
  TimePoint last_announce;
};

/// What is known of a node. Nothing of it is proven.
struct NodeDiscoveryInfo {
  NodeId node_id;
  std::string node_name;               ///< may be empty
  std::vector<NodeDiscoveryUrl> urls;  ///< at least one; in the order in which they were heard first
  std::string service_state_nonce;     ///< may be empty
};

struct NodeEvent {
  enum class Kind : std::uint8_t { found, changed, lost };
  Kind kind = Kind::found;
  NodeDiscoveryInfo node;  ///< as it is now; as it was last for lost
  // Of changed: what.
  bool urls_changed = false;
  bool name_changed = false;
  bool nonce_changed = false;  ///< its services are others now
};

struct DetectedNodesOptions {
  std::chrono::milliseconds expiry{60'000};  ///< of a URL after its last announcement; the node goes with its last URL
  /// Above, the node gives way that was not heard of for longest, unless it is confirmed.
  std::size_t max_nodes = 4096;
  std::size_t max_urls = 32;              ///< of one node; above, the one not heard for longest is replaced
  std::size_t max_nodes_of_sender = 512;  ///< that are not confirmed; above, the oldest of this sender gives way
};

/// A cache of announcements, sans-IO: told of them by any number of sources, asked by its owner. After each handle_*()
/// the owner takes all events.
class DetectedNodes {
 public:
  explicit DetectedNodes(DetectedNodesOptions options = {}) : options_(options) {}

  // --- told ---

  /// `sender`  where it came from, as far as that is known; empty: this machine, whose word is good.
  void handle_announcement(const Announcement& announcement, Now now, std::string_view sender = {});
  /// The node has answered for itself, so it is there: it does not give way to nodes that nobody has seen.
  void confirm(const NodeId& node_id);
  /// The node is known to have left this URL; for sources that see a node go.
  void handle_withdrawn(const NodeId& node_id, std::string_view url);
  /// As if the node had left all of its URLs; announced once more, it is found anew.
  void forget(const NodeId& node_id);
  void handle_timeout(Now now);

  // --- answers ---

  /// When handle_timeout() has something to do; may be earlier than that, never later.
  std::optional<TimePoint> poll_timeout() const { return next_expiry_; }
  std::optional<NodeEvent> poll_event();

  // --- looked at ---

  const std::map<NodeId, NodeDiscoveryInfo>& nodes() const { return nodes_; }

 private:
  using Nodes = std::map<NodeId, NodeDiscoveryInfo>;

  /// Removes URLs by `is_gone`; the node with the last of them. Returns the node behind.
  template <class F>
  Nodes::iterator drop_urls(Nodes::iterator node, F&& is_gone);

  bool make_room(const std::string& sender);
  void give_up(const NodeId& node_id);

  /// A node that is not confirmed. Anybody can claim to be any number of them.
  struct Claim {
    std::uint64_t turn;  ///< counts announcements
    std::string sender;  ///< of the first one
  };
  void claim(const NodeId& node_id, const std::string& sender);
  /// It is confirmed, or gone. Returns whose claim it was.
  std::optional<std::string> end_claim(const NodeId& node_id);

  DetectedNodesOptions options_;
  Nodes nodes_;
  std::map<NodeId, Claim> claims_;
  std::map<std::uint64_t, NodeId> claims_by_turn_;                           ///< the oldest one first
  std::map<std::string, std::map<std::uint64_t, NodeId>> claims_by_sender_;  ///< likewise
  std::uint64_t last_turn_ = 0;
  std::deque<NodeEvent> events_;
  std::optional<TimePoint> next_expiry_;
};

}  // namespace rr
