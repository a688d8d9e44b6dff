#include "core/support/time.hpp"

#include <limits>

namespace rr {

namespace {

constexpr std::int32_t second = 1'000'000'000;
constexpr TimeSpec first_time{std::numeric_limits<std::int64_t>::min(), 1 - second};
constexpr TimeSpec last_time{std::numeric_limits<std::int64_t>::max(), second - 1};

}  // namespace

TimeSpec TimeSpec::normalized() const {
  const std::int64_t carry = nanoseconds / second;
  // Peers send any numbers: what lies outside becomes the nearest time that can be told.
  if (carry > 0 && seconds > last_time.seconds - carry) return last_time;
  if (carry < 0 && seconds < first_time.seconds - carry) return first_time;
  const TimeSpec out{seconds + carry, nanoseconds % second};
  if (out.seconds > 0 && out.nanoseconds < 0) return {out.seconds - 1, out.nanoseconds + second};
  if (out.seconds < 0 && out.nanoseconds > 0) return {out.seconds + 1, out.nanoseconds - second};
  return out;
}

TimeSpec TimeSpec::plus_one_nanosecond() const {
  auto later = normalized();
  ++later.nanoseconds;
  return later.normalized();
}

}  // namespace rr
