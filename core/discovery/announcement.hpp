// The two packets of discovery over IP: "here is a node" and "who is there?". Layer: discovery.
// Source: transports spec sections 6.1, 6.3.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>

#include "core/discovery/ip_address.hpp"
#include "core/support/error.hpp"
#include "core/support/node_id.hpp"

namespace rr {

inline constexpr std::uint16_t discovery_port = 48653;
/// A datagram is read into a buffer of this size.
inline constexpr std::size_t max_discovery_packet_bytes = 8192;

/// One URL of one node. Unauthenticated: who a node is shows when connecting to it.
struct Announcement {
  NodeId node_id;
  std::string node_name;            ///< may be empty
  std::string url;                  ///< of its service index, as formatted by format_url()
  std::string service_state_nonce;  ///< changes with the node's services; empty where the node has none

  bool operator==(const Announcement&) const = default;
};

/// Where a datagram came from.
struct PacketSource {
  IpAddress address;
  std::string zone = {};         ///< of a link-local IPv6 address, as this machine names it: "eth0" or "4"
  bool is_this_machine = false;  ///< for certain: others can't send such a datagram
};

/// The packet's text, at most 2048 bytes: without the nonce where it would be longer.
std::string format_announcement(const Announcement& announcement);

/// Reads a packet and judges it. Where the URL's address is link-local IPv6, the zone of the source is put into it, so
/// that it can be connected to; a name that is too long or no node name becomes empty.
/// `own`    nodes to pass over.
/// Errors   protocol_error: not an announcement, or one that the rules refuse: the URL's address must be of the
/// sender's
///          family, link- or site-local (IPv6) or share its first two numbers with it (IPv4). A loopback address is
///          taken from this machine only; the reference takes it from everybody.
[[nodiscard]] Result<Announcement> parse_announcement(std::string_view packet, const PacketSource& source,
                                                      std::span<const NodeId> own = {});

/// `listener`  random, of the one who asks: it knows its own questions by it.
std::string format_discovery_request(const NodeId& listener);
/// Returns   the listener. Errors   protocol_error: not a request.
[[nodiscard]] Result<NodeId> parse_discovery_request(std::string_view packet);

/// 16 random letters and digits.
std::string make_service_state_nonce();

}  // namespace rr
