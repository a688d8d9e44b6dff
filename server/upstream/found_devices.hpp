// Nodes on the network that become devices of the gateway. Layer: server/upstream.
#pragma once

#include <boost/asio/cancellation_signal.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/steady_timer.hpp>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "core/discovery/service_refresh.hpp"
#include "node/discovery/discovery.hpp"
#include "server/config/config.hpp"
#include "server/upstream/allow_rules.hpp"
#include "server/upstream/device_registry.hpp"

namespace rrgate {

/// Listens for nodes, asks those for their services that a rule wants to know of, and keeps the devices of the registry
/// that were found. A found device goes when no rule allows its node any more; or when the node is not announced any
/// more, and the device does not answer or nobody uses it.
class FoundDevices {
 public:
  /// The CAs that found devices are checked against. See TlsFiles.
  /// Errors   those of make_node_tls(), where the configuration names CAs.
  [[nodiscard]] static rr::Result<std::shared_ptr<TlsFiles>> load_tls(const Discover& discover);

  /// `config` and `devices` must outlive it, and it the run() of `io`.
  FoundDevices(boost::asio::io_context& io, const Config& config, DeviceRegistry& devices,
               std::shared_ptr<TlsFiles> tls);

  void reload_tls(bool is_forced);
  void start();
  void stop();
  /// The configuration has been replaced; `before` was its part. Where more than the rules differs, all nodes are
  /// lost, and heard of anew; where devices would be made in another way, these are forgotten.
  /// `tls`  as load_tls() made it; null where discovery is off.
  void note_change(const Discover& before, std::shared_ptr<TlsFiles> tls);

  /// One node that is announced now.
  struct Entry {
    rr::NodeDiscoveryInfo node;
    bool is_allowed = false;
    const Device* device = nullptr;                        ///< found or configured; null: none
    std::optional<std::vector<rr::ServiceInfo>> services;  ///< null: not asked, or no answer yet
  };
  std::vector<Entry> list() const;
  /// Other sources of detections hand in here.
  rr::Discovery& discovery() { return *discovery_; }

 private:
  struct Node {
    rr::NodeDiscoveryInfo info;
    Verdict verdict;
    rr::ServiceRefresh refresh;
    std::optional<std::vector<rr::ServiceInfo>> services;
    std::shared_ptr<Device> device;  ///< that was made of it; null: none
    bool is_lost = false;            ///< not announced any more: there as long as its device answers and has clients
    /// There are devices at its place; until then they are looked at once more.
    std::optional<std::chrono::steady_clock::time_point> waits_until;
  };

  void listen();
  void handle(const rr::NodeEvent& event);
  void review(Node& node);
  /// Forgets nodes whose devices don't answer at the place of this new one: who restarts with another id keeps its
  /// name. Returns whether the node may have a device now; false: one there has to be looked at first.
  bool take_place(Node& node);
  /// Discovery forgets them, too, and tells of them when they are announced again; behind what it tells now.
  void withdraw_replaced();
  /// review() of all, and forgets those that are lost.
  void review_all();
  void drop_device(Node& node);
  std::string free_name(const rr::NodeDiscoveryInfo& node) const;
  /// Asks nodes when their time has come, and reviews all: a device that was configured may prove to be one of them.
  rr::awaitable<void> run();
  std::chrono::steady_clock::time_point next_work() const;
  void begin_question(const rr::NodeId& id, std::vector<rr::ConnectionUrl> urls);
  rr::awaitable<void> ask(rr::NodeId id, std::vector<rr::ConnectionUrl> urls);

  boost::asio::io_context& io_;
  const Config& config_;
  DeviceRegistry& devices_;
  std::shared_ptr<TlsFiles> tls_;
  std::optional<rr::Discovery> discovery_;
  std::map<rr::NodeId, Node> nodes_;
  std::vector<rr::NodeId> replaced_;  ///< by others at their place; discovery has not forgotten them yet
  std::set<std::shared_ptr<boost::asio::cancellation_signal>> questions_;  ///< under way
  std::size_t device_count_ = 0;
  bool is_full_ = false;
  bool is_stopping_ = false;
  std::chrono::steady_clock::time_point next_review_{};
  boost::asio::steady_timer wake_;
};

}  // namespace rrgate
