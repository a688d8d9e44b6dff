// How the nodes of a cell find one another: on this machine, by the types of their services. Layer: example.
#pragma once

#include <string>

#include "rrgate/subscribe.hpp"

namespace microassembly {

class Finder {
 public:
  /// `group`  what the names of the cell's nodes begin with: there may be other cells.
  Finder(boost::asio::io_context& io, std::string group) : group_(std::move(group)), discovery_(io, local_only()) {}

  /// Connects to all services of the type, and again when they come back.
  rr::ServiceSubscription subscribe(const std::string& type) {
    rr::ServiceSubscriptionFilter filter;
    rr::ServiceSubscriptionFilterNode node;
    node.node_name = group_ + ".*";
    filter.nodes.push_back(node);
    return rr::subscribe_service_by_type(discovery_, {"experimental.microassembly." + type}, filter);
  }

 private:
  static rr::DiscoveryOptions local_only() {
    rr::DiscoveryOptions options;
    options.ip = std::nullopt;
    options.hardware = std::nullopt;
    return options;
  }

  std::string group_;
  rr::Discovery discovery_;
};

}  // namespace microassembly
