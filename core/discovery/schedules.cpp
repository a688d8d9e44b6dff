#include "core/discovery/schedules.hpp"

#include <algorithm>

#include "core/support/random.hpp"

namespace rr {

using std::chrono::milliseconds;

namespace {
constexpr milliseconds soon{500};
constexpr int request_count = 3;
}  // namespace

void AnnounceSchedule::announce_soon(TimePoint now) {
  due_ = std::min(due_.value_or(now + soon), now + soon);
}

bool AnnounceSchedule::take_due(TimePoint now) {
  if (!due_ || now < *due_) return false;
  due_ = now + period_;
  return true;
}

void RequestSchedule::start(TimePoint now) {
  left_ = request_count;
  due_ = now + random_between(milliseconds(250), milliseconds(1000));
}

bool RequestSchedule::take_due(TimePoint now) {
  if (!due_ || now < *due_) return false;
  due_.reset();
  if (--left_ > 0) due_ = now + random_between(milliseconds(900), milliseconds(1500));
  return true;
}

}  // namespace rr
