#include "core/support/time.hpp"

#include <cstdio>
#include <ctime>
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

TimeSpec to_time_spec(std::chrono::system_clock::time_point time) {
  const auto utc = time.time_since_epoch();
  const auto seconds = std::chrono::floor<std::chrono::seconds>(utc);
  const auto rest = std::chrono::duration_cast<std::chrono::nanoseconds>(utc - seconds);
  return {seconds.count(), static_cast<std::int32_t>(rest.count())};
}

std::string format_utc(TimeSpec time, int digits) {
  const auto seconds = static_cast<std::time_t>(time.seconds);
  std::tm parts{};
  ::gmtime_r(&seconds, &parts);
  char text[40];
  const auto size = std::strftime(text, sizeof(text), "%Y-%m-%dT%H:%M:%S", &parts);
  char fraction[16];
  std::snprintf(fraction, sizeof(fraction), ".%09d", static_cast<int>(time.nanoseconds));
  return std::string(text, size).append(fraction, static_cast<std::size_t>(digits) + 1) + "Z";
}

}  // namespace rr
