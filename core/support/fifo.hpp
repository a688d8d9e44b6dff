// First in, first out, in one piece of memory. Layer: support.
#pragma once

#include <cstddef>
#include <utility>
#include <vector>

#include "core/support/bytes.hpp"

namespace rr {

/// A queue that allocates nothing while it stays as short as it was. (A std::deque of things that are not small takes
/// and gives back a block for each of them, and half a kilobyte while it is empty.)
template <class T>
class Fifo {
 public:
  bool empty() const { return first_ == items_.size(); }
  std::size_t size() const { return items_.size() - first_; }
  T& back() { return items_.back(); }
  void push_back(T item) { items_.push_back(std::move(item)); }
  /// The first one, which there must be.
  T take() {
    T item = std::move(items_[first_++]);
    // Those taken are cleared away when they are half of all: nothing is moved more often than it is added.
    if (first_ * 2 >= items_.size()) {
      items_.erase(items_.begin(), items_.begin() + static_cast<std::ptrdiff_t>(first_));
      first_ = 0;
      if (items_.empty()) clear_kept(items_);
    }
    return item;
  }

 private:
  std::vector<T> items_;
  std::size_t first_ = 0;  ///< that is not taken yet
};

}  // namespace rr
