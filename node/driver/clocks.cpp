#include "node/driver/clocks.hpp"

#include <chrono>

#include "node/platform/utc_time.hpp"

namespace rr {

Now read_clocks() {
  return {std::chrono::steady_clock::now(), to_time_spec(std::chrono::system_clock::now())};
}

}  // namespace rr
