// Whom limits by address count as one. Layer: server/limits. Source: RFC 4291 section 2.5.4, RFC 6177.
#pragma once

#include <algorithm>
#include <boost/asio/ip/address.hpp>
#include <string>
#include <string_view>

namespace rrgate {

/// An IPv4 address as it is, also where it comes as an IPv6 one; of an IPv6 address the first 64 bits: whoever has one
/// has them all.
inline boost::asio::ip::address client_network(const boost::asio::ip::address& address) {
  namespace ip = boost::asio::ip;
  if (!address.is_v6()) return address;
  const auto whole = address.to_v6();
  if (whole.is_loopback()) return address;
  if (whole.is_v4_mapped()) return ip::make_address_v4(ip::v4_mapped, whole);
  auto bytes = whole.to_bytes();
  std::fill(bytes.begin() + 8, bytes.end(), std::uint8_t{0});
  return ip::address_v6(bytes);
}

/// The name of client_network(): "192.0.2.1", "2001:db8::/64".
inline std::string network_name(const boost::asio::ip::address& address) {
  const auto network = client_network(address);
  return network.to_string() + (network.is_v6() && !network.is_loopback() ? "/64" : "");
}

/// What a network of IPv6, as network_name() gives it, is mostly a part of: "2001:db8:1::/48", as a site gets it whole.
/// What is none of these stays as it is.
inline std::string site_name(std::string_view network) {
  constexpr std::string_view length = "/64";
  if (!network.ends_with(length)) return std::string(network);
  boost::system::error_code error;
  const auto address = boost::asio::ip::make_address_v6(std::string(network.substr(0, network.size() - 3)), error);
  if (error) return std::string(network);
  auto bytes = address.to_bytes();
  std::fill(bytes.begin() + 6, bytes.end(), std::uint8_t{0});
  return boost::asio::ip::address_v6(bytes).to_string() + "/48";
}

/// The same of a client as logs name it: "192.0.2.1:40000", "[2001:db8::1]:40000", or an address alone. What is none of
/// these stays as it is.
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
