// Waits between attempts that grow from one failure to the next. Layer: node/driver.
#pragma once

#include <algorithm>
#include <chrono>

#include "core/support/random.hpp"

namespace rr {

/// Twice as long each time, half of it by chance: many who lost the same peer do not come back all at once.
class Backoff {
 public:
  Backoff(std::chrono::milliseconds first, std::chrono::milliseconds longest)
      : first_(first), longest_(longest), step_(first) {}

  /// The next wait, between half of the step and all of it.
  std::chrono::milliseconds next() {
    const auto step = step_;
    step_ = std::min(2 * step, longest_);
    return random_between(step / 2, step);
  }
  void reset() { step_ = first_; }

 private:
  std::chrono::milliseconds first_;
  std::chrono::milliseconds longest_;
  std::chrono::milliseconds step_;
};

}  // namespace rr
