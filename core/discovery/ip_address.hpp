// IP addresses as plain values: what discovery has to know about them. Layer: discovery.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string_view>

namespace rr {

/// An IPv4 or IPv6 address without zone.
struct IpAddress {
  bool is_v6 = false;
  std::array<std::uint8_t, 16> bytes{};  ///< network order; IPv4 uses the first four

  bool is_loopback() const;    ///< 127.0.0.0/8, ::1
  bool is_link_local() const;  ///< 169.254.0.0/16, fe80::/10
  bool is_site_local() const;  ///< fec0::/10
  bool operator==(const IpAddress&) const = default;
};

/// Reads an address literal: "192.168.1.5", "fe80::1", "::ffff:10.0.0.1". A zone ("%eth0") is not part of it.
std::optional<IpAddress> parse_ip_address(std::string_view text);

/// The same for the host of a URL, whose zone is passed over.
std::optional<IpAddress> parse_url_address(std::string_view host);

}  // namespace rr
