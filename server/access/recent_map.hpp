// What is remembered by key, with a bound. Layer: server/access.
#pragma once

#include <list>
#include <string>
#include <string_view>
#include <unordered_map>
#include <utility>

namespace rrgate {

/// Keeps the values that were used last: a new one takes the place of the one that was not used for longest, never
/// of all. Strangers choose the keys.
template <class Value>
class RecentMap {
 public:
  explicit RecentMap(std::size_t max) : max_(max) {}

  /// The value of a key, made of `arguments` where there is none. `may_go`  whether a value may be forgotten; of those
  /// that may not, a few are passed over, then the map grows.
  template <class MayGo, class... Arguments>
  Value& use_unless(MayGo may_go, const std::string& key, Arguments&&... arguments) {
    if (auto* found = find(key)) return *found;
    if (by_key_.size() >= max_) make_room(may_go);
    entries_.emplace_front(std::piecewise_construct, std::forward_as_tuple(key),
                           std::forward_as_tuple(std::forward<Arguments>(arguments)...));
    by_key_.emplace(entries_.front().first, entries_.begin());
    return entries_.front().second;
  }
  template <class... Arguments>
  Value& use(const std::string& key, Arguments&&... arguments) {
    return use_unless([](const Value&) { return true; }, key, std::forward<Arguments>(arguments)...);
  }
  /// Null where there is none.
  Value* find(std::string_view key) {
    const auto found = by_key_.find(key);
    if (found == by_key_.end()) return nullptr;
    entries_.splice(entries_.begin(), entries_, found->second);
    return &found->second->second;
  }
  void clear() {
    by_key_.clear();
    entries_.clear();
  }
  std::size_t size() const { return by_key_.size(); }

 private:
  using Entries = std::list<std::pair<const std::string, Value>>;
  static constexpr int max_passed_over = 8;

  template <class MayGo>
  void make_room(MayGo may_go) {
    for (int i = 0; i < max_passed_over; ++i) {
      const auto oldest = std::prev(entries_.end());
      if (may_go(oldest->second)) {
        by_key_.erase(oldest->first);
        entries_.erase(oldest);
        return;
      }
      entries_.splice(entries_.begin(), entries_, oldest);  // in use: that is as recent as can be
    }
  }

  std::size_t max_;
  Entries entries_;  ///< the one used last comes first
  std::unordered_map<std::string_view, typename Entries::iterator> by_key_;
};

}  // namespace rrgate
