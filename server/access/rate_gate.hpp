// How much somebody may ask for: so many requests a second, so many at a time. Layer: server/access.
#pragma once

#include <algorithm>
#include <chrono>
#include <cstddef>
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "server/access/recent_map.hpp"

namespace rrgate {

/// Counts by key: an address, a user, a device.
class RateGate {
  struct Count {
    std::size_t open = 0;
    double left;  ///< requests that may come at once
    std::chrono::steady_clock::time_point last;
  };
  using Counts = RecentMap<Count>;

 public:
  using Time = std::chrono::steady_clock::time_point;

  /// Held while a request is answered.
  class Pass {
   public:
    Pass(Pass&& other) noexcept : counts_(std::move(other.counts_)), key_(std::move(other.key_)) {}
    Pass& operator=(Pass&& other) noexcept {
      std::swap(counts_, other.counts_);
      std::swap(key_, other.key_);
      return *this;
    }
    ~Pass() {
      if (!counts_) return;
      if (auto* count = counts_->find(key_)) --count->open;
    }

   private:
    friend class RateGate;
    Pass(std::shared_ptr<Counts> counts, std::string key) : counts_(std::move(counts)), key_(std::move(key)) {}
    std::shared_ptr<Counts> counts_;
    std::string key_;
  };

  /// nullopt: too much. Bounds of 0 are none.
  std::optional<Pass> enter(const std::string& key, std::size_t per_second, std::size_t at_once, Time now) {
    if (per_second == 0 && at_once == 0) return Pass(nullptr, {});
    const auto is_idle = [](const Count& count) { return count.open == 0; };
    auto& count = counts_->use_unless(is_idle, key, Count{0, static_cast<double>(per_second), now});
    const auto most = static_cast<double>(per_second);
    const std::chrono::duration<double> passed = now - count.last;
    count.last = now;
    count.left = std::min(most, count.left + passed.count() * most);
    if ((at_once > 0 && count.open >= at_once) || (per_second > 0 && count.left < 1)) return std::nullopt;
    if (per_second > 0) count.left -= 1;
    ++count.open;
    return Pass(counts_, key);
  }
  std::size_t keys() const { return counts_->size(); }

 private:
  static constexpr std::size_t max_keys = 10'000;

  std::shared_ptr<Counts> counts_ = std::make_shared<Counts>(max_keys);
};

}  // namespace rrgate
