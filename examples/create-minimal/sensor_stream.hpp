// The sensor stream of an iRobot Create: packets out of the bytes of its serial line. Layer: example, pure.
// Source: iRobot Create Open Interface, command 148; numbers are big-endian.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

namespace create_minimal {

/// What the service asks the robot for: bumps and wheel drops, distance, angle, buttons.
inline constexpr std::uint8_t bumps_id = 7, distance_id = 19, angle_id = 20, buttons_id = 18;
inline constexpr std::uint8_t stream_header = 19;
inline constexpr std::uint8_t packet_bytes = 10;  // that these four are, each behind its number

/// Cuts the stream at its packets: header, count, so many bytes, and a check sum that makes them all 0 modulo 256.
class StreamReader {
 public:
  void feed(std::span<const std::uint8_t> bytes);
  /// The bytes between count and check sum of the next whole packet. What is no packet is left out.
  std::optional<std::vector<std::uint8_t>> next();

 private:
  std::vector<std::uint8_t> bytes_;  ///< less than one packet after next() has returned none
};

struct Sensors {
  std::uint8_t bumps = 0;    ///< bit 0: right, bit 1: left
  int distance = 0;          ///< in mm since the packet before
  int angle = 0;             ///< in degrees likewise, counter-clockwise
  std::uint8_t buttons = 0;  ///< bit 0: play
};

/// nullopt: holds something else, or less.
std::optional<Sensors> read_sensors(std::span<const std::uint8_t> packet);

}  // namespace create_minimal
