#include "examples/demo/sensor_packet.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace rrgate::demo {

namespace {

class PacketWriter {
 public:
  void write8(int value) { bytes_.push_back(static_cast<std::uint8_t>(value)); }
  void write16(int value) {
    value = std::clamp(value, -32768, 65535);
    write8(value >> 8);
    write8(value);
  }
  std::vector<std::uint8_t> take() { return std::move(bytes_); }

 private:
  std::vector<std::uint8_t> bytes_;
};

int whole(double value) {
  return static_cast<int>(std::lround(value));
}

}  // namespace

std::vector<std::uint8_t> SensorStream::next_packet(const Robot& robot) {
  const int distance = whole(robot.distance());
  const int angle = whole(robot.angle() * 180 / std::numbers::pi);
  const bool is_driving = robot.wheel_speeds().left != 0 || robot.wheel_speeds().right != 0;

  PacketWriter packet;
  packet.write8(robot.bumpers());                                   // 7 bumps and wheel drops
  for (int number = 8; number <= 16; ++number) packet.write8(0);    // wall, cliffs, virtual wall, overcurrents
  packet.write8(255);                                               // 17 infrared: nothing received
  packet.write8(0);                                                 // 18 buttons
  packet.write16(distance - last_distance_);                        // 19 distance, mm
  packet.write16(angle - last_angle_);                              // 20 angle, degrees
  packet.write8(0);                                                 // 21 charging state: not charging
  packet.write16(16'100);                                           // 22 voltage, mV
  packet.write16(is_driving ? -950 : -210);                         // 23 current, mA
  packet.write8(24);                                                // 24 battery temperature, degrees Celsius
  packet.write16(2'550);                                            // 25 battery charge, mAh
  packet.write16(2'700);                                            // 26 battery capacity, mAh
  for (int number = 27; number <= 31; ++number) packet.write16(0);  // wall and cliff signals
  packet.write8(0);                                                 // 32 cargo bay digital inputs
  packet.write16(0);                                                // 33 cargo bay analog signal
  packet.write8(0);                                                 // 34 charging sources available
  packet.write8(3);                                                 // 35 mode: full
  packet.write8(0);                                                 // 36 song number
  packet.write8(0);                                                 // 37 song playing
  packet.write8(1);                                                 // 38 number of stream packets
  packet.write16(robot.commanded_velocity());                       // 39
  packet.write16(robot.commanded_radius());                         // 40
  packet.write16(whole(robot.wheel_speeds().right));                // 41
  packet.write16(whole(robot.wheel_speeds().left));                 // 42
  last_distance_ = distance;
  last_angle_ = angle;
  return packet.take();
}

}  // namespace rrgate::demo
