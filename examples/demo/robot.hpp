// The simulated iRobot Create: a round robot with two driven wheels and two bumpers. Layer: demo, pure.
// Units: millimetres, radians, seconds; headings and turns counter-clockwise from the x axis.
// Source: iRobot Create Open Interface (Drive command, sensor packets).
#pragma once

#include <chrono>
#include <cstdint>

#include "examples/demo/world.hpp"

namespace rrgate::demo {

/// Radii of Drive() that are no radius.
inline constexpr std::int16_t drive_straight = 32767;
inline constexpr std::int16_t drive_straight_too = -32768;
inline constexpr std::int16_t spin_clockwise = -1;
inline constexpr std::int16_t spin_counterclockwise = 1;

struct Pose {
  Point position;
  double heading = 0;  ///< in (-pi, pi]
};

struct WheelSpeeds {
  double left = 0;  ///< mm/s
  double right = 0;
};

class Robot {
 public:
  static constexpr double radius = 165;
  static constexpr double wheel_base = 258;  ///< between the wheels
  static constexpr double max_speed = 500;   ///< of each wheel, mm/s
  static constexpr std::chrono::milliseconds step{10};
  static constexpr std::uint8_t right_bumper = 1;  ///< bits of bumpers()
  static constexpr std::uint8_t left_bumper = 2;

  /// `start` must be clear of everything in `world`.
  explicit Robot(World world, Pose start = {});

  /// Drives until told otherwise. `velocity` is that of the robot's centre in mm/s (spinning: of the wheels), forwards
  /// positive; `radius_mm` that of the centre's circle, positive to the left, or one of the constants above; 0 is
  /// straight. Velocities beyond +-500 and radii beyond +-2000 count as these limits, as on the robot. Where a wheel
  /// would have to be faster than 500 mm/s both are slowed: the arc stays.
  void drive(std::int16_t velocity, std::int16_t radius_mm);

  /// Lifts the robot to `pose`, which must be clear, and lets it stand there. The totals stay.
  void place(Pose pose);

  /// Moves on by one step. Returns whether a bumper that was free before is pressed now.
  bool advance();

  const World& world() const { return world_; }
  const Pose& pose() const { return pose_; }
  WheelSpeeds wheel_speeds() const { return wheels_; }
  std::int16_t commanded_velocity() const { return commanded_velocity_; }
  std::int16_t commanded_radius() const { return commanded_radius_; }
  /// How fast it really moved in the last step: against a wall the wheels slip.
  double speed() const { return speed_; }          ///< mm/s along the heading
  double turn_rate() const { return turn_rate_; }  ///< rad/s
  /// Totals since construction; backwards and clockwise count down.
  double distance() const { return distance_; }  ///< mm along the heading
  double angle() const { return angle_; }        ///< radians
  std::uint8_t bumpers() const { return bumpers_; }

 private:
  Point push_out(Point position) const;
  std::uint8_t feel_bumpers() const;

  World world_;
  Pose pose_;
  WheelSpeeds wheels_;
  std::int16_t commanded_velocity_ = 0;
  std::int16_t commanded_radius_ = drive_straight;
  double speed_ = 0;
  double turn_rate_ = 0;
  double distance_ = 0;
  double angle_ = 0;
  std::uint8_t bumpers_ = 0;
};

/// What Drive() asks of the wheels.
WheelSpeeds wheel_speeds_for(std::int16_t velocity, std::int16_t radius_mm);

}  // namespace rrgate::demo
