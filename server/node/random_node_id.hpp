// A fresh NodeID. Layer: node.
#pragma once

#include "core/support/node_id.hpp"

namespace rr {

/// 122 random bits from the system, in the form of a version 4 UUID.
NodeId random_node_id();

}  // namespace rr
