// The system's clock as the core tells time, and as text. Layer: node/platform.
#pragma once

#include <chrono>
#include <string>

#include "core/support/time.hpp"

namespace rr {

TimeSpec to_time_spec(std::chrono::system_clock::time_point time);
/// "2026-11-24T15:00:00.000Z", with so many digits behind the point, 1 to 9. `time` is normalized, and no earlier than
/// 1970.
std::string format_utc(TimeSpec time, int digits);

}  // namespace rr
