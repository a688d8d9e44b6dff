// When to announce a node and when to ask for others. Layer: discovery. Source: transports spec section 6.2.
#pragma once

#include <chrono>
#include <optional>

#include "core/support/time.hpp"

namespace rr {

/// Announces half a second after the start and after every reason to do so, else once a period.
class AnnounceSchedule {
 public:
  explicit AnnounceSchedule(std::chrono::milliseconds period = std::chrono::milliseconds(55'000)) : period_(period) {}

  /// Something changed, or somebody asked: pulls the next announcement in. Many of these make one announcement.
  void announce_soon(TimePoint now);
  /// When the next announcement is due; nothing before the first announce_soon().
  std::optional<TimePoint> poll_timeout() const { return due_; }
  /// Whether to announce now; the next one is a period later then.
  [[nodiscard]] bool take_due(TimePoint now);

 private:
  std::chrono::milliseconds period_;
  std::optional<TimePoint> due_;
};

/// Asks three times, at random intervals: listeners that start together do not ask together, and a lost datagram does
/// not matter.
class RequestSchedule {
 public:
  void start(TimePoint now);
  std::optional<TimePoint> poll_timeout() const { return due_; }
  /// Whether to ask now.
  [[nodiscard]] bool take_due(TimePoint now);

 private:
  int left_ = 0;
  std::optional<TimePoint> due_;
};

}  // namespace rr
