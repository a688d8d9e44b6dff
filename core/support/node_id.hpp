// NodeID: 16 bytes in UUID text order; all zero means "any". Layer: support. Source: messages spec section 12.
#pragma once

#include <array>
#include <compare>
#include <cstdint>
#include <cstring>
#include <string>
#include <string_view>

#include "core/support/error.hpp"

namespace rr {

struct NodeId {
  std::array<std::uint8_t, 16> bytes{};

  bool is_any() const { return *this == NodeId{}; }
  bool operator==(const NodeId&) const = default;
  /// libc++ 13 cannot default it: its std::array has no operator<=>.
  std::strong_ordering operator<=>(const NodeId& other) const {
    return std::memcmp(bytes.data(), other.bytes.data(), bytes.size()) <=> 0;
  }
};

enum class NodeIdFormat {
  braces,  ///< {00112233-4455-6677-8899-aabbccddeeff}
  dashes,  ///< 00112233-4455-6677-8899-aabbccddeeff
  plain,   ///< 00112233445566778899aabbccddeeff
};

std::string format_node_id(const NodeId& id, NodeIdFormat format = NodeIdFormat::braces);

/// Accepts all three formats in either case, dashes individually optional, both braces or none, and exactly "{0}".
/// Errors   invalid_argument.
Result<NodeId> parse_node_id(std::string_view text);

/// `^[a-zA-Z][a-zA-Z0-9_.-]*$`, at most 1024 characters; the empty name is not valid here.
bool is_valid_node_name(std::string_view name);

}  // namespace rr
