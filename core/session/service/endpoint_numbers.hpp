// The numbers by which a node tells its sessions apart. Layer: session. Source: sessions spec sections 2.2 and 2.8.
#pragma once

#include <chrono>
#include <cstdint>
#include <deque>
#include <functional>
#include <unordered_set>
#include <utility>

#include "core/support/random.hpp"
#include "core/support/time.hpp"

namespace rr {

/// Random numbers that are unique in a node. One that a session has left is nobody's for a while: what its peer may
/// still send must not reach another session.
class EndpointNumbers {
 public:
  static constexpr std::chrono::seconds rest{300};

  /// `draw`  gives the numbers to choose from, none of them 0.
  explicit EndpointNumbers(std::function<std::uint32_t()> draw = random_endpoint) : draw_(std::move(draw)) {}

  std::uint32_t take(TimePoint now);
  /// `number` was taken and is given back once.
  void give_back(std::uint32_t number, TimePoint now) { resting_.emplace_back(now + rest, number); }

 private:
  std::function<std::uint32_t()> draw_;
  std::unordered_set<std::uint32_t> taken_;  ///< those that rest included
  std::deque<std::pair<TimePoint, std::uint32_t>> resting_;
};

}  // namespace rr
