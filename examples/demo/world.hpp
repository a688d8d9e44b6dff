// The room that the demo devices share: walls and round obstacles. Layer: demo, pure.
// Units: millimetres; x to the east, y to the north.
#pragma once

#include <cstdint>
#include <vector>

namespace rrgate::demo {

struct Point {
  double x = 0;
  double y = 0;
  bool operator==(const Point&) const = default;
};
inline Point operator+(Point a, Point b) {
  return {a.x + b.x, a.y + b.y};
}
inline Point operator-(Point a, Point b) {
  return {a.x - b.x, a.y - b.y};
}
inline Point operator*(Point a, double factor) {
  return {a.x * factor, a.y * factor};
}
inline double dot(Point a, Point b) {
  return a.x * b.x + a.y * b.y;
}
inline double cross(Point a, Point b) {
  return a.x * b.y - a.y * b.x;
}
double length(Point a);

struct Color {
  std::uint8_t red = 0;
  std::uint8_t green = 0;
  std::uint8_t blue = 0;
  bool operator==(const Color&) const = default;
};

/// An upright wall without thickness.
struct Wall {
  Point from;
  Point to;
  double height = 500;
  Color color;
};

/// An upright cylinder.
struct Obstacle {
  Point center;
  double radius = 0;
  double height = 300;
  Color color;
};

struct World {
  std::vector<Wall> walls;
  std::vector<Obstacle> obstacles;
};

/// Where something of the world comes nearest to a point.
struct Contact {
  double distance = 0;  ///< from the point to the surface; negative inside an obstacle
  Point normal;         ///< unit length, from the surface towards the point
};

/// One contact for everything of `world` that is nearer to `point` than `reach`.
std::vector<Contact> find_contacts(const World& world, Point point, double reach);

/// The room of the demo, 5 m by 4 m around the origin, where the robot starts facing east with free way ahead.
World demo_world();

}  // namespace rrgate::demo
