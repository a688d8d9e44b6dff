// How much somebody may ask for: so many requests a second, so many at a time. Layer: server/access.
#pragma once

#include <algorithm>
#include <chrono>
#include <cstddef>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>

namespace rrgate {

/// Counts by key: an address, a user, a device.
class RateGate {
  struct Count {
    std::size_t open;
    double left;  ///< requests that may come at once
    std::chrono::steady_clock::time_point last;
  };
  using Counts = std::map<std::string, Count>;

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
      if (const auto found = counts_->find(key_); found != counts_->end()) --found->second.open;
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
    if (counts_->size() >= max_keys) forget_idle(now);
    auto& count = counts_->try_emplace(key, Count{0, static_cast<double>(per_second), now}).first->second;
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
  /// Above it, who has asked nothing for a second is forgotten: he could ask for as much anew anyway.
  static constexpr std::size_t max_keys = 10'000;

  void forget_idle(Time now) {
    std::erase_if(*counts_, [now](const auto& item) {
      return item.second.open == 0 && now - item.second.last > std::chrono::seconds(1);
    });
  }

  std::shared_ptr<Counts> counts_ = std::make_shared<Counts>();
};

}  // namespace rrgate
