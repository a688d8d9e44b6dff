// Cycles of a directed graph, without recursion. Layer: robdef.
#pragma once

#include <cstddef>
#include <vector>

namespace rr {

/// For each node, the nodes it points to.
using Graph = std::vector<std::vector<std::size_t>>;

/// Groups of nodes that all reach each other: at least two nodes, or one that points to itself. Nodes of a group are
/// ascending, groups are ordered by their first node. Linear in nodes and edges.
std::vector<std::vector<std::size_t>> find_cycles(const Graph& graph);

/// All nodes, each after every node that it points to; nodes of cycles in any order.
std::vector<std::size_t> dependencies_first(const Graph& graph);

}  // namespace rr
