// A queue that keeps its memory. Layer: support.
#pragma once

#include <cstddef>
#include <optional>
#include <type_traits>
#include <utility>
#include <vector>

#include "core/support/bytes.hpp"

namespace rr {

/// First in, first out. Unlike std::deque, which gives its blocks back and takes new ones as items pass through, it
/// allocates nothing in the steady state.
template <class T>
class Fifo {
  static_assert(std::is_nothrow_move_constructible_v<T>, "else items are copied when the memory grows");

 public:
  bool empty() const { return first_ == items_.size(); }
  std::size_t size() const { return items_.size() - first_; }
  T& back() { return items_.back(); }
  /// `item`  what a T is made of.
  template <class Item>
  void push(Item&& item) {
    items_.emplace_back(std::forward<Item>(item));
  }
  /// Takes the oldest item out.
  std::optional<T> poll() {
    if (empty()) return std::nullopt;
    std::optional<T> item(std::move(items_[first_]));
    // Places of items that were taken out are given up when they are half of all: nothing is moved twice as often as it
    // is polled.
    if (++first_ * 2 < items_.size()) return item;
    items_.erase(items_.begin(), items_.begin() + static_cast<std::ptrdiff_t>(first_));
    first_ = 0;
    if (items_.empty()) clear_kept(items_);
    return item;
  }

 private:
  std::vector<T> items_;
  std::size_t first_ = 0;  ///< of items_ that was not taken out yet
};

}  // namespace rr
