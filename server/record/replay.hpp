// A recording as nodes: each service that was recorded, and one that controls the replay. Layer: server/record.
#pragma once

#include <boost/asio/io_context.hpp>
#include <functional>
#include <memory>
#include <set>
#include <string>
#include <vector>

#include "node/service/node.hpp"
#include "server/record/player.hpp"
#include "server/record/replayed_service.hpp"

namespace rrgate {

struct ReplayOptions {
  /// Of the first node; the others take the ports behind it. "rr+intra:///": for clients of this process.
  std::string listen = "rr+tcp://127.0.0.1:0";
  /// Nodes have the NodeIDs of those that were recorded, which then must not run beside them.
  bool keeps_ids = false;
  /// What could not be played: each member once.
  std::function<void(const std::string&)> report;
};

/// For the thread of its io_context, which outlives it.
class Replay {
 public:
  /// Throws   std::invalid_argument: the recording does not hold what it takes, or not such a URL; std::runtime_error:
  ///          it can't listen there.
  Replay(boost::asio::io_context& io, Recording recording, ReplayOptions options);
  Replay(const Replay&) = delete;
  Replay& operator=(const Replay&) = delete;

  Player& player() { return player_; }
  /// Of each service: what clients connect to.
  const std::vector<std::string>& urls() const { return urls_; }
  /// Of the service that controls it, at each node: "replay", or, where recorded services have that or "replay_2", ...,
  /// the next number
  const std::string& control_name() const { return control_name_; }
  void stop();

 private:
  struct Node {
    rr::NodeIdentity recorded;
    std::unique_ptr<rr::Node> node;
    std::string address;                  ///< "rr+tcp://127.0.0.1:52222/?": what follows names the service
    std::set<std::string> services = {};  ///< by name; without the one that controls it
  };
  Node& node_of(const RecordedService& recorded);
  /// Returns  its address.
  std::string listen(rr::Node& node) const;
  void add_control(rr::Node& node);
  ReplayedService& service_of(std::uint16_t channel);
  void play(const McapMessage& message, McapTime shift);
  void tell_state();
  void report(const std::string& problem) const;

  boost::asio::io_context& io_;
  ReplayOptions options_;
  Player player_;
  std::string control_name_;
  std::vector<ReplayedService> services_;
  std::vector<std::shared_ptr<rr::Service>> controls_;
  std::vector<Node> nodes_;
  std::vector<std::string> urls_;
  std::set<std::uint16_t> problems_;  ///< channels of which it was told
};

}  // namespace rrgate
