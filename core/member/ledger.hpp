// What became of the values of one subscription. Layer: member.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <chrono>
#include <cstddef>
#include <cstdint>

#include "core/support/time.hpp"

namespace rr {

/// How long values waited here before they were handed to the stream, in powers of two of a microsecond.
class AgeHistogram {
 public:
  static constexpr std::size_t bucket_count = 28;  ///< the last one: 67 s and more

  void add(std::chrono::nanoseconds age) {
    const auto us = static_cast<std::uint64_t>(std::max<std::int64_t>(age.count(), 0) / 1000);
    ++counts_[std::min<std::size_t>(static_cast<std::size_t>(std::bit_width(us)), bucket_count - 1)];
    sum_us_ += us;
  }
  void add(const AgeHistogram& other) {
    for (std::size_t i = 0; i < bucket_count; ++i) counts_[i] += other.counts_[i];
    sum_us_ += other.sum_us_;
  }
  /// Ages of bucket i are below this.
  static constexpr std::chrono::microseconds upper_bound(std::size_t bucket) {
    return std::chrono::microseconds(std::int64_t{1} << bucket);
  }
  const std::array<std::uint64_t, bucket_count>& counts() const { return counts_; }
  std::uint64_t total() const {
    std::uint64_t sum = 0;
    for (const auto count : counts_) sum += count;
    return sum;
  }
  std::uint64_t sum_us() const { return sum_us_; }
  /// An age that `share` (0 to 1) of all values did not exceed; zero where there are none.
  std::chrono::microseconds quantile(double share) const {
    const auto wanted = static_cast<double>(total()) * share;
    std::uint64_t seen = 0;
    for (std::size_t i = 0; i < bucket_count; ++i) {
      seen += counts_[i];
      if (counts_[i] != 0 && static_cast<double>(seen) >= wanted) return upper_bound(i);
    }
    return std::chrono::microseconds(0);
  }

 private:
  std::array<std::uint64_t, bucket_count> counts_{};
  std::uint64_t sum_us_ = 0;
};

struct Ledger {
  std::uint64_t delivered = 0;  ///< handed to the stream
  std::uint64_t conflated = 0;  ///< replaced by a newer value before that
  std::uint64_t dropped = 0;    ///< lost
  AgeHistogram ages;

  void note_delivery(std::chrono::nanoseconds age) {
    ++delivered;
    ages.add(age);
  }
  void add(const Ledger& other) {
    delivered += other.delivered;
    conflated += other.conflated;
    dropped += other.dropped;
    ages.add(other.ages);
  }
};

/// Of many subscriptions together.
struct Ledgers {
  Ledger wires = {};
  Ledger pipes = {};

  void add(const Ledgers& other) {
    wires.add(other.wires);
    pipes.add(other.pipes);
  }
};

}  // namespace rr
