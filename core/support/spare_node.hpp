// A node of a map that is used again. Layer: support.
#pragma once

#include <utility>

namespace rr {

/// Keeps the node of an item that was taken out of a map for the item that comes next: items that come one after
/// another allocate nothing. `Map` is a node-based map with unique keys.
template <class Map>
class SpareNode {
 public:
  /// Adds an item, whose key is new to the map.
  void insert(Map& map, typename Map::key_type key, typename Map::mapped_type value) {
    if (node_.empty()) {
      map.emplace(std::move(key), std::move(value));
      return;
    }
    node_.key() = std::move(key);
    node_.mapped() = std::move(value);
    map.insert(std::move(node_));
  }
  /// Returns the item of a node that was extracted.
  typename Map::mapped_type take(typename Map::node_type node) {
    node_ = std::move(node);
    return std::exchange(node_.mapped(), typename Map::mapped_type{});
  }

 private:
  typename Map::node_type node_;
};

}  // namespace rr
