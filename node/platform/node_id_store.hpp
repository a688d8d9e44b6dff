// The NodeID that belongs to a NodeName on this machine, shared with the reference. Layer: node/platform.
// Source: transports spec section 8.3.
#pragma once

#include <string_view>

#include "core/support/node_id.hpp"
#include "node/platform/locked_file.hpp"

namespace rr {

/// Nobody else on this machine is the node of that name while this lives.
class NodeIdClaim {
 public:
  /// The NodeID that was stored for `name`, or a new one, which is stored.
  /// Errors   invalid_argument: not a node name; system_resource_permission_denied: the name is in use;
  ///          invalid_configuration: the file holds no NodeID; system_resource_error: it can't be read or written.
  [[nodiscard]] static Result<NodeIdClaim> take(std::string_view name);

  const NodeId& id() const { return id_; }

 private:
  NodeIdClaim(NodeId id, LockedFile lock) : id_(id), lock_(std::move(lock)) {}
  NodeId id_;
  LockedFile lock_;
};

}  // namespace rr
