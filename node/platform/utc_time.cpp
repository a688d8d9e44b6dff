#include "node/platform/utc_time.hpp"

#include <cstdio>
#include <ctime>

namespace rr {

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
