// Discovery packets over UDP: sockets, groups, interfaces. Layer: node/discovery.
// Source: transports spec sections 6, 6.1, 6.2 (rescan).
#pragma once

#include <array>
#include <boost/asio/any_io_executor.hpp>
#include <boost/asio/ip/udp.hpp>
#include <boost/asio/steady_timer.hpp>
#include <functional>
#include <memory>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "core/discovery/announcement.hpp"
#include "node/discovery/local_address.hpp"

namespace rr {

/// Where packets go, and where they are heard.
struct IpDiscoveryScopes {
  bool node_local = false;  ///< FF01::BA86, this machine alone
  bool link_local = true;   ///< FF02::BA86
  bool site_local = false;  ///< FF05::BA86
  bool ipv4_broadcast = false;
};

/// Sends and receives. For the thread of its executor; may be destroyed at any time but in its own callbacks.
class IpDiscovery {
 public:
  struct Callbacks {
    std::function<void(std::string_view packet, const PacketSource& source)> received;
    std::function<void()> addresses_changed;  ///< this machine's; or packets may have been missed
    std::function<void(const std::string& problem)> report;
  };

  /// Receives too where `listens`. Looks for new and gone interfaces every 5 s.
  IpDiscovery(const boost::asio::any_io_executor& executor, IpDiscoveryScopes scopes, bool listens,
              Callbacks callbacks);
  ~IpDiscovery();
  IpDiscovery(const IpDiscovery&) = delete;
  IpDiscovery& operator=(const IpDiscovery&) = delete;

  const std::vector<LocalAddress>& addresses() const;
  /// Sends from one address to the groups of all scopes in its interface's zone, or to its IPv4 network.
  /// `stays_here`  only to this machine: the packet speaks of a loopback address.
  void send(const LocalAddress& from, std::string_view packet, bool stays_here = false);
  /// Sends once from every interface, for packets that speak of no address.
  void send_everywhere(std::string_view packet);

 private:
  class Implementation;
  std::shared_ptr<Implementation> implementation_;
};

}  // namespace rr
