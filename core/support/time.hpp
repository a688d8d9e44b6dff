// Time as a parameter: one reading of both clocks. Layer: support. Source: messages spec section 13.
#pragma once

#include <chrono>
#include <compare>
#include <cstdint>

namespace rr {

/// Seconds and nanoseconds since 1970-01-01T00:00:00 UTC; both have the same sign after normalized().
struct TimeSpec {
  std::int64_t seconds = 0;
  std::int32_t nanoseconds = 0;

  /// The first or last time that can be told where the sum lies outside.
  TimeSpec normalized() const;
  TimeSpec plus_one_nanosecond() const;
  // clang-tidy 14 takes the 0 that a rewritten comparison compares with for a pointer.
  auto operator<=>(const TimeSpec&) const = default;  // NOLINT(modernize-use-nullptr)
};

/// One reading of the clocks, taken by the driver and handed to every call that depends on time.
/// `steady` drives deadlines; `utc` stamps wire packets.
struct Now {
  std::chrono::steady_clock::time_point steady;
  TimeSpec utc;
};

using TimePoint = std::chrono::steady_clock::time_point;

}  // namespace rr
