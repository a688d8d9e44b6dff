#include "examples/demo/world.hpp"

#include <algorithm>
#include <cmath>

namespace rrgate::demo {

double length(Point a) {
  return std::hypot(a.x, a.y);
}

namespace {

/// The unit vector of `a`; where there is none, any.
Point direction_of(Point a) {
  const double size = length(a);
  return size > 1e-9 ? a * (1 / size) : Point{1, 0};
}

Contact contact_with(const Wall& wall, Point point) {
  const Point along = wall.to - wall.from;
  const double squared = dot(along, along);
  const double t = squared > 0 ? std::clamp(dot(point - wall.from, along) / squared, 0.0, 1.0) : 0.0;
  const Point offset = point - (wall.from + along * t);
  return {length(offset), direction_of(offset)};
}

Contact contact_with(const Obstacle& obstacle, Point point) {
  const Point offset = point - obstacle.center;
  return {length(offset) - obstacle.radius, direction_of(offset)};
}

}  // namespace

std::vector<Contact> find_contacts(const World& world, Point point, double reach) {
  std::vector<Contact> contacts;
  const auto look_at = [&](const Contact& contact) {
    if (contact.distance < reach) contacts.push_back(contact);
  };
  for (const Wall& wall : world.walls) look_at(contact_with(wall, point));
  for (const Obstacle& obstacle : world.obstacles) look_at(contact_with(obstacle, point));
  return contacts;
}

World demo_world() {
  constexpr Color brick{196, 92, 70};
  constexpr Color sand{214, 182, 120};
  constexpr Color slate{96, 122, 148};
  constexpr Color moss{112, 150, 92};
  constexpr Color ink{70, 74, 110};
  World world;
  world.walls = {
      {{-2500, -2000}, {2500, -2000}, 500, sand}, {{2500, -2000}, {2500, 2000}, 500, brick},
      {{2500, 2000}, {-2500, 2000}, 500, slate},  {{-2500, 2000}, {-2500, -2000}, 500, moss},
      {{-2500, 800}, {-1100, 800}, 400, ink},     {{900, -2000}, {900, -900}, 400, ink},
  };
  world.obstacles = {
      {{1500, 1000}, 200, 350, {230, 160, 40}},
      {{-1300, -900}, 250, 450, {60, 140, 160}},
      {{200, 1350}, 120, 250, {170, 80, 150}},
  };
  return world;
}

}  // namespace rrgate::demo
