// Which URLs a node is announced with, and from which addresses. Layer: node/discovery.
// Source: transports spec section 6.1.
#pragma once

#include <string>
#include <vector>

#include "core/support/node_id.hpp"
#include "node/discovery/local_address.hpp"

namespace rr {

/// Where a node listens: an address of this machine, or all of them ("0.0.0.0"; "::" means IPv4 as well).
struct ListenAddress {
  std::string scheme;
  std::string host;
  std::uint16_t port = 0;
};

struct AnnouncedUrl {
  LocalAddress from;
  std::string url;
  bool stays_here = false;  ///< a loopback address
};

/// One URL for every address that is listened at: IPv4, and of IPv6 link-local addresses, which need no zone in it. A
/// loopback address is announced from all link-local ones: the loopback interface itself carries no multicast.
std::vector<AnnouncedUrl> announced_urls(const NodeId& node_id, const std::vector<ListenAddress>& listens,
                                         const std::vector<LocalAddress>& addresses);

}  // namespace rr
