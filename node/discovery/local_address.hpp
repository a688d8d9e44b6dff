// The addresses of this machine, by interface. Layer: node/discovery.
#pragma once

#include <boost/asio/ip/address.hpp>
#include <optional>
#include <string>
#include <vector>

#include "core/discovery/ip_address.hpp"

namespace rr {

struct LocalAddress {
  boost::asio::ip::address address;  ///< a link-local IPv6 address has its scope id
  std::string interface;
  unsigned interface_index = 0;
  std::optional<boost::asio::ip::address_v4> broadcast = {};  ///< of its network, for IPv4

  bool is_link_local() const { return address.is_v6() && address.to_v6().is_link_local(); }
  bool operator==(const LocalAddress&) const = default;
};

/// Addresses of interfaces that are up and can be bound now: not those that the system still checks for duplicates.
std::vector<LocalAddress> local_addresses();

/// Without the scope id.
IpAddress to_ip_address(const boost::asio::ip::address& address);

/// The zone of `scope_id` as a URL may say it: the interface's name, its number where the name has other characters.
std::string zone_of(unsigned long scope_id);

}  // namespace rr
