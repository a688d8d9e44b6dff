// Values by key, never more than fit: the one that nobody has asked for longest goes. Layer: server/limits.
#pragma once

#include <cstddef>
#include <functional>
#include <list>
#include <unordered_map>
#include <utility>

namespace rrgate {

/// What is kept of clients that nobody knows: whoever comes with ever new keys pushes out the oldest ones, and has no
/// others forgotten. Each call takes the same time, however many there are.
template <class Key, class T, class Hash = std::hash<Key>>
class BoundedTable {
 public:
  explicit BoundedTable(std::size_t max_size) : max_size_(max_size) {}

  /// The value of `key`, made of `arguments` where there is none yet. Valid until the next call of at().
  template <class... Arguments>
  T& at(const Key& key, Arguments&&... arguments) {
    if (auto* known = find(key)) return *known;
    if (by_key_.size() >= max_size_) erase(order_.back().first);
    order_.emplace_front(std::piecewise_construct, std::forward_as_tuple(key),
                         std::forward_as_tuple(std::forward<Arguments>(arguments)...));
    by_key_.emplace(key, order_.begin());
    return order_.front().second;
  }
  /// Null: there is none. Asking counts.
  T* find(const Key& key) {
    const auto found = by_key_.find(key);
    if (found == by_key_.end()) return nullptr;
    order_.splice(order_.begin(), order_, found->second);
    return &found->second->second;
  }
  void clear() {
    by_key_.clear();
    order_.clear();
  }
  std::size_t size() const { return by_key_.size(); }

 private:
  using Order = std::list<std::pair<const Key, T>>;

  void erase(const Key& key) {
    const auto known = by_key_.extract(key);
    order_.erase(known.mapped());
  }

  std::size_t max_size_;
  Order order_;  ///< the one that was asked for last in front
  std::unordered_map<Key, typename Order::iterator, Hash> by_key_;
};

}  // namespace rrgate
