// How old values were when they arrived: percentiles of any number of them in a fixed space. Test of load.
#pragma once

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstdint>

/// Ages from 1 us to 1000 s, each kept within 2 %.
class AgeHistogram {
 public:
  void add(std::chrono::nanoseconds age) {
    const double microseconds = std::max(1.0, static_cast<double>(age.count()) / 1000);
    const auto bucket = static_cast<std::size_t>(std::log(microseconds) / std::log(step));
    ++counts_[std::min(bucket, counts_.size() - 1)];
    ++count_;
    max_ = std::max(max_, age);
  }
  std::uint64_t count() const { return count_; }
  double max_ms() const { return static_cast<double>(max_.count()) / 1e6; }
  /// The age that `share` (0..1) of all values do not exceed, in milliseconds; 0 without values.
  double percentile_ms(double share) const {
    const auto rank = static_cast<std::uint64_t>(std::ceil(share * static_cast<double>(count_)));
    std::uint64_t seen = 0;
    for (std::size_t bucket = 0; bucket < counts_.size(); ++bucket) {
      seen += counts_[bucket];
      if (seen >= rank && seen > 0) return std::min(max_ms(), std::pow(step, static_cast<double>(bucket + 1)) / 1000);
    }
    return 0;
  }

 private:
  static constexpr double step = 1.02;
  std::array<std::uint64_t, 1050> counts_{};
  std::uint64_t count_ = 0;
  std::chrono::nanoseconds max_{};
};
