#include "bench.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace microassembly {

namespace {

constexpr double speed = 2;       // in mm/s
constexpr double turn_speed = 1;  // in rad/s
constexpr double half_width = 5;  // of the bench, in mm
constexpr std::uint32_t pixels = 96;
constexpr double view_width = 5;  // of a microscope, in mm

double nearer(double from, double to, double most) {
  return from + std::clamp(to - from, -most, most);
}

}  // namespace

Poses home_poses() {
  Poses out;
  for (std::size_t i = 0; i < probe_count; ++i) {
    const double angle = 2 * std::numbers::pi * static_cast<double>(i) / probe_count;
    out.push_back({3 * std::cos(angle), 3 * std::sin(angle), 1, 0});
  }
  return out;
}

bool is_reachable(const Pose& pose) {
  return std::abs(pose.x) <= half_width && std::abs(pose.y) <= half_width && pose.z >= 0 && pose.z <= 2 &&
         std::abs(pose.theta) <= 2 * std::numbers::pi;
}

Pose step(const Pose& pose, const Pose& target, double seconds) {
  const double most = speed * seconds;
  return {nearer(pose.x, target.x, most), nearer(pose.y, target.y, most), nearer(pose.z, target.z, most),
          nearer(pose.theta, target.theta, turn_speed * seconds)};
}

Picture look(std::size_t number, const Poses& probes, double focus, const Numbers& levels) {
  const double left = number % 2 == 0 ? -half_width : 0;
  const double bottom = number < 2 ? 0 : -half_width;
  double light = 0.1;
  for (const double level : levels) light += 0.3 * level;
  Picture out;
  out.width = out.height = pixels;
  out.step = 3 * pixels;
  for (std::uint32_t row = 0; row < pixels; ++row)
    for (std::uint32_t column = 0; column < pixels; ++column) {
      const double x = left + view_width * column / pixels;
      const double y = bottom + view_width * (pixels - row) / pixels;
      double shine = 0.15;
      for (const auto& probe : probes) {
        // A tip, and a shaft that shows the angle.
        const double along = (x - probe.x) * std::cos(probe.theta) + (y - probe.y) * std::sin(probe.theta);
        const double across = (y - probe.y) * std::cos(probe.theta) - (x - probe.x) * std::sin(probe.theta);
        const double away = std::hypot(std::max(0.0, std::abs(along - 0.4) - 0.4), across);
        const double blur = 0.08 + 0.3 * std::abs(probe.z - focus);
        shine += 0.9 * 0.08 / blur * std::exp(-away * away / (2 * blur * blur));
      }
      const auto level = static_cast<std::uint8_t>(std::clamp(255 * light * shine, 0.0, 255.0));
      out.data.insert(out.data.end(), {level, level, level});
    }
  return out;
}

}  // namespace microassembly
