// Whom an address counts as. Layer: server/access.
#pragma once

#include <algorithm>
#include <boost/asio/ip/address.hpp>
#include <string>
#include <string_view>

namespace rrgate {

/// Where clients are told apart by address: an IPv4 address is one client, of IPv6 a network of 64 bits, as each of
/// them has as many addresses as it likes. "::ffff:192.0.2.1" is 192.0.2.1.
inline boost::asio::ip::address network_of(const boost::asio::ip::address& address) {
  if (!address.is_v6()) return address;
  const auto v6 = address.to_v6();
  if (v6.is_v4_mapped()) return boost::asio::ip::make_address_v4(boost::asio::ip::v4_mapped, v6);
  if (v6.is_loopback()) return address;
  auto bytes = v6.to_bytes();
  std::fill(bytes.begin() + 8, bytes.end(), std::uint8_t{0});
  return boost::asio::ip::address_v6(bytes);
}

/// As network_name() of a client as logs name it: "192.0.2.1:40000", "[2001:db8::1]:40000", or an address alone. What
/// is none of these stays as it is.
std::string network_name_of(std::string_view client);

/// "192.0.2.1", "2001:db8::/64".
inline std::string network_name(const boost::asio::ip::address& address) {
  const auto network = network_of(address);
  return network.to_string() + (network.is_v6() && !network.is_loopback() ? "/64" : "");
}

inline std::string network_name_of(std::string_view client) {
  auto host = client;
  if (host.starts_with('['))
    host = host.substr(1, host.find(']') - 1);
  else if (const auto colon = host.find(':'); colon != std::string_view::npos && host.rfind(':') == colon)
    host = host.substr(0, colon);
  boost::system::error_code error;
  const auto address = boost::asio::ip::make_address(std::string(host), error);
  return error ? std::string(client) : network_name(address);
}

}  // namespace rrgate
