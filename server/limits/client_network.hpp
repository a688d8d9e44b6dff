// Whom limits by address count as one. Layer: server/limits. Source: RFC 4291 section 2.5.4, RFC 6177.
#pragma once

#include <algorithm>
#include <boost/asio/ip/address.hpp>

namespace rrgate {

/// An IPv4 address as it is, also where it comes as an IPv6 one; of an IPv6 address the first 64 bits: whoever has one
/// has them all.
inline boost::asio::ip::address client_network(const boost::asio::ip::address& address) {
  namespace ip = boost::asio::ip;
  if (!address.is_v6()) return address;
  const auto whole = address.to_v6();
  if (whole.is_v4_mapped()) return ip::make_address_v4(ip::v4_mapped, whole);
  auto bytes = whole.to_bytes();
  std::fill(bytes.begin() + 8, bytes.end(), std::uint8_t{0});
  return ip::address_v6(bytes);
}

}  // namespace rrgate
