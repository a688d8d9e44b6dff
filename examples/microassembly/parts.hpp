// The stages and the illuminators: nodes that know nobody. Layer: example.
#pragma once

#include <algorithm>
#include <string>

#include "bench.hpp"
#include "rrgate/device.hpp"

namespace microassembly {

[[noreturn]] inline void refuse(const std::string& why) {
  throw rr::ServiceException(why, rr::ErrorCode::invalid_argument);
}

inline void check_numbers(const char* what, const Numbers& numbers, std::size_t count, double least, double most) {
  if (numbers.size() != count)
    refuse(std::to_string(numbers.size()) + " " + what + ", expected " + std::to_string(count));
  for (const double number : numbers)
    if (!(number >= least && number <= most))
      refuse(what + (": found " + std::to_string(number)) + ", expected " + std::to_string(least) + " to " +
             std::to_string(most));
}

class Stages : public definition::StagesService {
 public:
  void move(double seconds) {
    for (std::size_t i = 0; i < current_.size(); ++i) current_[i] = step(current_[i], targets_[i], seconds);
    poses(current_);
  }

 private:
  Poses get_targets() override { return targets_; }
  void set_targets(Poses targets) override {
    if (targets.size() != targets_.size())
      refuse(std::to_string(targets.size()) + " targets, expected " + std::to_string(targets_.size()));
    if (!std::all_of(targets.begin(), targets.end(), is_reachable)) refuse("a target is outside of the bench");
    targets_ = std::move(targets);
  }
  void halt() override { targets_ = current_; }

  Poses current_ = home_poses();
  Poses targets_ = current_;
};

class Illuminators : public definition::IlluminatorsService {
 private:
  Numbers get_levels() override { return levels_; }
  void set_levels(Numbers levels) override {
    check_numbers("levels", levels, illuminator_count, 0, 1);
    levels_ = std::move(levels);
  }

  Numbers levels_ = Numbers(illuminator_count, 0.8);
};

}  // namespace microassembly
