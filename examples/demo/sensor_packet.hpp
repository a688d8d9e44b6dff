// The robot's sensor stream: bytes as the Create's serial interface sends them. Layer: demo, pure.
// Source: iRobot Create Open Interface, sensor packets 7 to 42; numbers are big-endian.
#pragma once

#include <cstdint>
#include <vector>

#include "examples/demo/robot.hpp"

namespace rrgate::demo {

/// Packet group 6: all sensors, 52 bytes.
inline constexpr std::uint8_t all_sensors = 6;

/// Makes one packet after another; distance and angle in each are those since the one before.
class SensorStream {
 public:
  std::vector<std::uint8_t> next_packet(const Robot& robot);

 private:
  int last_distance_ = 0;
  int last_angle_ = 0;
};

}  // namespace rrgate::demo
