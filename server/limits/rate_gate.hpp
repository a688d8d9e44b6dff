// How much somebody may ask for: so many requests a second, so many at a time. Layer: server/limits.
#pragma once

#include <algorithm>
#include <chrono>
#include <cstddef>
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "server/limits/bounded_table.hpp"

namespace rrgate {

/// Counts by key: an address, a user, a device.
class RateGate {
  struct Count {
    std::size_t open;
    double left;  ///< requests that may come at once
    std::chrono::steady_clock::time_point last;
  };

 public:
  using Time = std::chrono::steady_clock::time_point;

  /// Held while a request is answered.
  class Pass {
   public:
    Pass(Pass&& other) noexcept = default;
    Pass& operator=(Pass&& other) noexcept {
      std::swap(count_, other.count_);
      return *this;
    }
    ~Pass() {
      if (count_) --count_->open;
    }

   private:
    friend class RateGate;
    explicit Pass(std::shared_ptr<Count> count) : count_(std::move(count)) {}
    std::shared_ptr<Count> count_;
  };

  /// nullopt: too much. Bounds of 0 are none.
  std::optional<Pass> enter(const std::string& key, std::size_t per_second, std::size_t at_once, Time now) {
    if (per_second == 0 && at_once == 0) return Pass(nullptr);
    auto& count = counts_.at(key);
    if (!count) count = std::make_shared<Count>(Count{0, static_cast<double>(per_second), now});
    const auto most = static_cast<double>(per_second);
    const std::chrono::duration<double> passed = now - count->last;
    count->last = now;
    count->left = std::min(most, count->left + passed.count() * most);
    if ((at_once > 0 && count->open >= at_once) || (per_second > 0 && count->left < 1)) return std::nullopt;
    if (per_second > 0) count->left -= 1;
    ++count->open;
    return Pass(count);
  }
  std::size_t keys() const { return counts_.size(); }

 private:
  static constexpr std::size_t max_keys = 10'000;

  BoundedTable<std::string, std::shared_ptr<Count>> counts_{max_keys};
};

}  // namespace rrgate
