// How fast a gateway looks at its devices, all together. Layer: server/upstream.
#pragma once

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <ratio>
#include <utility>

namespace rrgate {

/// Looks that would begin faster than the pace wait for their turn, so that looking at thousands of devices takes a
/// bounded share of the processor, and looks that hold memory are few at a time. Few devices never wait. Those that
/// wait begin several at a time: a look for which the process wakes alone takes half as much again, since what it needs
/// has left the processor's caches.
class LookPace {
 public:
  using TimePoint = std::chrono::steady_clock::time_point;
  enum class Look : std::uint8_t {
    first,  ///< somebody waits for the gateway to know its devices
    later,
  };

  static constexpr int first_per_second = 1000;
  static constexpr int later_per_second = 125;
  static constexpr int at_once = 100;                           ///< may begin together, where none have begun lately
  using Beat = std::chrono::duration<std::int64_t, std::deci>;  ///< from those that begin together to the next ones

  /// Takes a turn. Returns when it is: `now`, or a later beat.
  TimePoint take_turn(Look look, TimePoint now) {
    const std::chrono::microseconds step(1'000'000 / (look == Look::first ? first_per_second : later_per_second));
    auto& next = look == Look::first ? next_first_ : next_later_;
    next = std::max(next, now - (at_once - 1) * step);
    const auto turn = std::exchange(next, next + step);
    return turn <= now ? now : std::chrono::ceil<Beat>(turn);
  }

 private:
  TimePoint next_first_{};  ///< `at_once` looks may come before their time
  TimePoint next_later_{};
};

}  // namespace rrgate
