#include "examples/demo/robot.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace rrgate::demo {

namespace {

constexpr double touch_distance = 0.5;                          // mm: nearer than this counts as touching
constexpr double bumper_overlap = 15 * std::numbers::pi / 180;  // straight ahead presses both

double wrap_angle(double angle) {
  angle = std::remainder(angle, 2 * std::numbers::pi);
  return angle <= -std::numbers::pi ? std::numbers::pi : angle;
}

/// Where the centre gets to on an arc of this length and turn: its chord points along the middle heading.
Point along_arc(const Pose& from, double distance, double turn) {
  const double half = turn / 2;
  const double chord = std::abs(half) < 1e-9 ? distance : distance * std::sin(half) / half;
  const double middle = from.heading + half;
  return from.position + Point{std::cos(middle), std::sin(middle)} * chord;
}

}  // namespace

WheelSpeeds wheel_speeds_for(std::int16_t velocity, std::int16_t radius_mm) {
  const double v = std::clamp<double>(velocity, -Robot::max_speed, Robot::max_speed);
  if (radius_mm == spin_counterclockwise) return {-v, v};
  if (radius_mm == spin_clockwise) return {v, -v};
  if (radius_mm == drive_straight || radius_mm == drive_straight_too || radius_mm == 0) return {v, v};
  const double r = std::clamp<double>(radius_mm, -2000, 2000);
  const double half_base = Robot::wheel_base / 2;
  WheelSpeeds speeds{v * (r - half_base) / r, v * (r + half_base) / r};
  const double fastest = std::max(std::abs(speeds.left), std::abs(speeds.right));
  const double slow_down = std::min(1.0, Robot::max_speed / std::max(fastest, 1.0));
  return {speeds.left * slow_down, speeds.right * slow_down};
}

Robot::Robot(World world, Pose start) : world_(std::move(world)), pose_(start) {}

void Robot::drive(std::int16_t velocity, std::int16_t radius_mm) {
  commanded_velocity_ = velocity;
  commanded_radius_ = radius_mm;
  wheels_ = wheel_speeds_for(velocity, radius_mm);
}

void Robot::place(Pose pose) {
  pose_ = pose;
  drive(0, drive_straight);
  bumpers_ = feel_bumpers();
}

bool Robot::advance() {
  const double seconds = std::chrono::duration<double>(step).count();
  const double wanted = (wheels_.left + wheels_.right) / 2 * seconds;
  const double turn = (wheels_.right - wheels_.left) / wheel_base * seconds;
  const Point position = push_out(along_arc(pose_, wanted, turn));
  const double middle = pose_.heading + turn / 2;
  const double moved = dot(position - pose_.position, {std::cos(middle), std::sin(middle)});

  pose_ = {position, wrap_angle(pose_.heading + turn)};
  speed_ = moved / seconds;
  turn_rate_ = turn / seconds;
  distance_ += moved;
  angle_ += turn;

  const std::uint8_t before = bumpers_;
  bumpers_ = feel_bumpers();
  return (bumpers_ & ~before) != 0;
}

/// Takes out of a wished position what goes into walls; the robot slides along them. In a corner that one push after
/// another does not clear, it stays where it is.
Point Robot::push_out(Point position) const {
  for (int attempt = 0; attempt < 4; ++attempt) {
    const auto contacts = find_contacts(world_, position, radius);
    if (contacts.empty()) return position;
    const auto deepest = std::min_element(contacts.begin(), contacts.end(),
                                          [](const Contact& a, const Contact& b) { return a.distance < b.distance; });
    position = position + deepest->normal * (radius - deepest->distance + 1e-6);
  }
  return find_contacts(world_, position, radius).empty() ? position : pose_.position;
}

std::uint8_t Robot::feel_bumpers() const {
  std::uint8_t pressed = 0;
  for (const Contact& contact : find_contacts(world_, pose_.position, radius + touch_distance)) {
    const double bearing = wrap_angle(std::atan2(-contact.normal.y, -contact.normal.x) - pose_.heading);
    if (std::abs(bearing) > std::numbers::pi / 2) continue;  // behind: there is no bumper
    if (bearing > -bumper_overlap) pressed |= left_bumper;
    if (bearing < bumper_overlap) pressed |= right_bumper;
  }
  return pressed;
}

}  // namespace rrgate::demo
