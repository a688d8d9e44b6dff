#include "core/support/time.hpp"

namespace rr {

TimeSpec TimeSpec::normalized() const {
  constexpr std::int32_t second = 1'000'000'000;
  TimeSpec out{seconds + nanoseconds / second, nanoseconds % second};
  if (out.seconds > 0 && out.nanoseconds < 0) return {out.seconds - 1, out.nanoseconds + second};
  if (out.seconds < 0 && out.nanoseconds > 0) return {out.seconds + 1, out.nanoseconds - second};
  return out;
}

TimeSpec TimeSpec::plus_one_nanosecond() const {
  return TimeSpec{seconds, nanoseconds + 1}.normalized();
}

}  // namespace rr
