// How much somebody may ask for: so many requests a second, so many at a time. Layer: server/access.
#pragma once

#include <algorithm>
#include <chrono>
#include <cstddef>
#include <map>
#include <optional>
#include <string>
#include <utility>

namespace rrgate {

/// Counts by key: an address, a user, a device. Outlives its passes.
class RateGate {
 public:
  using Time = std::chrono::steady_clock::time_point;

  /// Held while a request is answered.
  class Pass {
   public:
    Pass(Pass&& other) noexcept : gate_(std::exchange(other.gate_, nullptr)), key_(std::move(other.key_)) {}
    Pass& operator=(Pass&& other) noexcept {
      std::swap(gate_, other.gate_);
      std::swap(key_, other.key_);
      return *this;
    }
    ~Pass() {
      if (gate_) gate_->leave(key_);
    }

   private:
    friend class RateGate;
    Pass(RateGate* gate, std::string key) : gate_(gate), key_(std::move(key)) {}
    RateGate* gate_;
    std::string key_;
  };

  /// nullopt: too much. Bounds of 0 are none.
  std::optional<Pass> enter(const std::string& key, std::size_t per_second, std::size_t at_once, Time now) {
    if (per_second == 0 && at_once == 0) return Pass(nullptr, {});
    if (counts_.size() >= max_keys) forget_idle(now);
    auto& count = counts_.try_emplace(key, Count{0, static_cast<double>(per_second), now}).first->second;
    const auto most = static_cast<double>(per_second);
    const std::chrono::duration<double> passed = now - count.last;
    count.last = now;
    count.left = std::min(most, count.left + passed.count() * most);
    if ((at_once > 0 && count.open >= at_once) || (per_second > 0 && count.left < 1)) return std::nullopt;
    if (per_second > 0) count.left -= 1;
    ++count.open;
    return Pass(this, key);
  }
  std::size_t keys() const { return counts_.size(); }

 private:
  struct Count {
    std::size_t open;
    double left;  ///< requests that may come at once
    Time last;
  };
  /// Above it, who has asked nothing for a second is forgotten: he could ask for as much anew anyway.
  static constexpr std::size_t max_keys = 10'000;

  void forget_idle(Time now) {
    std::erase_if(counts_, [now](const auto& item) {
      return item.second.open == 0 && now - item.second.last > std::chrono::seconds(1);
    });
  }
  void leave(const std::string& key) {
    const auto found = counts_.find(key);
    if (found != counts_.end()) --found->second.open;
  }

  std::map<std::string, Count> counts_;
};

}  // namespace rrgate
