// Which found nodes may become devices, and which ways to them may be taken for that. Layer: server/upstream.
#pragma once

#include <string_view>
#include <vector>

#include "node/discovery/service_query.hpp"
#include "server/config/config.hpp"

namespace rrgate {

/// What the rules say about a node. Nobody connects to it but at these URLs.
struct Verdict {
  bool is_allowed = false;
  std::vector<rr::ConnectionUrl> device_urls;  ///< of an allowed node; none when none of its URLs can be dialed
  /// To ask for the services that a rule demands; none when they are of no consequence. A rule that narrows nodes by
  /// name or id takes any URL, others those at link-local and loopback addresses: whoever announces anything gets a
  /// connection by them, but never one that leads out of the network.
  std::vector<rr::ConnectionUrl> urls_to_ask;
};

/// `services`  what the node said when it was asked; null before.
Verdict judge(const std::vector<DiscoverRule>& rules, const rr::NodeDiscoveryInfo& node,
              const std::vector<rr::ServiceInfo>* services);

}  // namespace rrgate
