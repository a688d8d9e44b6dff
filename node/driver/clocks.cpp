#include "node/driver/clocks.hpp"

#include <chrono>

namespace rr {

Now read_clocks() {
  const auto utc = std::chrono::system_clock::now().time_since_epoch();
  const auto seconds = std::chrono::floor<std::chrono::seconds>(utc);
  const auto rest = std::chrono::duration_cast<std::chrono::nanoseconds>(utc - seconds);
  return {std::chrono::steady_clock::now(), {seconds.count(), static_cast<std::int32_t>(rest.count())}};
}

}  // namespace rr
