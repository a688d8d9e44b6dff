// One sensor of the fleet. Layer: example.
#pragma once

#include <cmath>
#include <string>

#include "experimental__fleet.hpp"
#include "rrgate/device.hpp"

namespace fleet {

class Sensor : public experimental::fleet::SensorService {
 public:
  explicit Sensor(std::uint32_t number) : number_(number) {}

  /// `seconds`  since the fleet began. A wave of warmth goes through it: a minute passes until it is here again.
  void measure(double seconds) {
    constexpr double turn = 6.283185307179586;
    temperature(20 + 5 * std::sin(turn * (seconds / 60 - number_ / 100.0)) + offset_);
  }

 private:
  std::uint32_t get_number() override { return number_; }
  double get_offset() override { return offset_; }
  void set_offset(double offset) override {
    if (!(offset >= -10 && offset <= 10))
      throw rr::ServiceException("offset: found " + std::to_string(offset) + ", expected -10 to 10",
                                 rr::ErrorCode::invalid_argument);
    offset_ = offset;
  }

  std::uint32_t number_;
  double offset_ = 0;
};

}  // namespace fleet
