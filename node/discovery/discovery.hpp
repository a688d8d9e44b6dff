// Finding nodes on the local network, on this machine and plugged into it, and being found. Layer: node/discovery.
// Source: transports spec sections 6 and 8.5.
//
//   rr::Discovery discovery(io);
//   discovery.announce(node);                                   // a service: others find it
//   discovery.watch([](const rr::NodeEvent& event) { ... });    // a client: who comes and goes
//   auto arms = co_await discovery.find_service_by_type("com.robotraconteur.robotics.robot.Robot");
#pragma once

#include <boost/asio/io_context.hpp>
#include <chrono>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/discovery/detected_nodes.hpp"
#include "node/discovery/announced_urls.hpp"
#include "node/discovery/ip_discovery.hpp"
#include "node/discovery/service_query.hpp"
#include "node/transport/driver_device.hpp"

namespace rr {

class Node;

struct DiscoveryOptions {
  std::optional<IpDiscoveryScopes> ip =
      IpDiscoveryScopes{};  ///< nullopt: no packets; announcements come from elsewhere
  bool listens = true;      ///< false: hears of nobody, and does not answer those who ask
  bool intra = true;        ///< nodes of this process (rr+intra)
  /// Nodes of this machine (rr+local): this user's, and the public ones of all users.
  bool local = true;
  /// Nodes that are plugged in (rr+usb, rr+pci), where the system shows them; nullopt: none.
  std::optional<DriverRoots> hardware = DriverRoots{};
  std::chrono::milliseconds announce_period{55'000};
  DetectedNodesOptions cache = {};
  /// How nodes are asked for their services: whose certificates are trusted, how long one may take.
  DialOptions dial = {};
  /// A sentence about something that went wrong; the default writes it to stderr.
  std::function<void(const std::string& problem)> report = {};
};

/// For the thread of the io_context, which must outlive it.
class Discovery {
 public:
  explicit Discovery(boost::asio::io_context& io, DiscoveryOptions options = {});
  ~Discovery();
  Discovery(const Discovery&) = delete;
  Discovery& operator=(const Discovery&) = delete;

  boost::asio::io_context& io_context();

  // --- who is there ---

  std::vector<NodeDiscoveryInfo> detected_nodes() const;
  /// `handler` hears of every node once as found, those known already first, then of changes and losses, until
  /// unwatch(). It may call anything here but destroy the Discovery.
  using WatchId = std::uint64_t;
  using Watcher = std::function<void(const NodeEvent& event)>;
  WatchId watch(Watcher handler);
  void unwatch(WatchId id);
  /// Asks all nodes to announce themselves; they do within about half a second. Looks for local ones again.
  void refresh();

  // --- finding. Schemes: those of URLs that will do ("rr+tcp", ...), empty for any. They may be waited for while the
  // Discovery is destroyed: they find nothing then. ---

  /// Services whose root object is of the type, on all nodes that answer in time. A quarter of the time goes into
  /// asking who is there.
  awaitable<std::vector<ServiceInfo>> find_service_by_type(
      std::string type, std::vector<std::string> schemes = {},
      std::chrono::milliseconds timeout = std::chrono::milliseconds(5000));
  /// The node, or all nodes of the name; as soon as there is one. Empty: none until the end of the timeout.
  awaitable<std::vector<NodeDiscoveryInfo>> find_node_by_id(
      NodeId id, std::vector<std::string> schemes = {},
      std::chrono::milliseconds timeout = std::chrono::milliseconds(5000));
  awaitable<std::vector<NodeDiscoveryInfo>> find_node_by_name(
      std::string name, std::vector<std::string> schemes = {},
      std::chrono::milliseconds timeout = std::chrono::milliseconds(5000));

  // --- being found ---

  /// Announces `node` where it listens, now and later. It must outlive the Discovery, or be withdrawn.
  void announce(Node& node);
  /// The same for any other listener: announces a node at its listen addresses, which are asked for each time.
  /// `identity.name` may be empty. A node that was announced already is replaced.
  void announce(NodeIdentity identity, std::function<std::vector<ListenAddress>()> listens);
  /// Its services are others now: those who know the node ask again.
  void services_changed(const NodeId& node_id);
  void withdraw(const NodeId& node_id);

  // --- other sources of detections ---

  void handle_announcement(const Announcement& announcement);
  /// The node has answered: in a flood of announcements it is not given up for others.
  void confirm(const NodeId& node_id);
  void handle_withdrawn(const NodeId& node_id, std::string_view url);
  /// Watchers hear that the node is lost, and of it again when it is announced once more.
  void forget(const NodeId& node_id);

 private:
  class Implementation;
  std::shared_ptr<Implementation> implementation_;
};

}  // namespace rr
