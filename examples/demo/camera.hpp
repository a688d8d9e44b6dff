// A camera in the demo room: a small ray caster. Layer: demo, pure.
#pragma once

#include <cstdint>
#include <vector>

#include "examples/demo/robot.hpp"
#include "examples/demo/world.hpp"

namespace rrgate::demo {

/// Rows from top to bottom; three bytes a pixel, blue, green, red; `step` bytes from one row to the next.
struct Image {
  int width = 0;
  int height = 0;
  int step = 0;
  std::vector<std::uint8_t> data;

  Color at(int column, int row) const;
};

/// How a camera is mounted on the robot and what it sees.
struct Camera {
  Point offset;         ///< from the robot's centre: x ahead, y to the left; mm
  double yaw = 0;       ///< radians to the left of the robot's heading
  double height = 220;  ///< above the floor; below every wall's top, so that the horizon is never seen over walls
  double field_of_view = 1.2;  ///< radians, horizontally
  int width = 320;
  int height_pixels = 240;

  /// In pixels: an object of s mm at a depth of z mm is focal_length() * s / z pixels large.
  double focal_length() const;
};

/// What `camera` sees from a robot at `pose`.
Image render(const World& world, const Pose& pose, const Camera& camera);

}  // namespace rrgate::demo
