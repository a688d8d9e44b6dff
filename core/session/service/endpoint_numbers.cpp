#include "core/session/service/endpoint_numbers.hpp"

namespace rr {

std::uint32_t EndpointNumbers::take(TimePoint now) {
  for (; !resting_.empty() && resting_.front().first <= now; resting_.pop_front())
    taken_.erase(resting_.front().second);
  while (true)
    if (const auto number = draw_(); taken_.insert(number).second) return number;
}

}  // namespace rr
