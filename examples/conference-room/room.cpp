#include "room.hpp"

#include <algorithm>

namespace conference_room {

namespace {

constexpr double height = 2;      // of the lights above the sensors, in m
constexpr double strength = 900;  // of a light, in lx at 1 m
constexpr double Colour::*colours[] = {&Colour::red, &Colour::green, &Colour::blue};

Places make_grid(int columns, int rows, Place first, Place step) {
  Places out;
  for (int row = 0; row < rows; ++row)
    for (int column = 0; column < columns; ++column) out.push_back({first.x + column * step.x, first.y + row * step.y});
  return out;
}

}  // namespace

Places light_places() {
  return make_grid(4, 2, {1, 1.5}, {2, 3});
}

Places sensor_places() {
  return make_grid(3, 4, {1.5, 0.75}, {2.5, 1.5});
}

double transport(const Place& light, const Place& sensor) {
  const double x = light.x - sensor.x;
  const double y = light.y - sensor.y;
  return strength / (height * height + x * x + y * y);
}

Colours measure(const Colours& levels, const Places& lights, const Places& sensors, const Colour& daylight) {
  Colours out(sensors.size(), daylight);
  for (std::size_t i = 0; i < sensors.size(); ++i)
    for (std::size_t j = 0; j < lights.size(); ++j)
      for (const auto colour : colours) out[i].*colour += transport(lights[j], sensors[i]) * levels[j].*colour;
  return out;
}

Colours follow(const Colours& levels, const Places& lights, const Colours& readings, const Places& sensors,
               const Colour& target, double gain) {
  double square = 0;  // of the norm of T
  for (const auto& light : lights)
    for (const auto& sensor : sensors) square += transport(light, sensor) * transport(light, sensor);
  Colours out = levels;
  for (std::size_t j = 0; j < lights.size(); ++j)
    for (const auto colour : colours) {
      double slope = 0;
      for (std::size_t i = 0; i < sensors.size(); ++i)
        slope += transport(lights[j], sensors[i]) * (target.*colour - readings[i].*colour);
      out[j].*colour = std::clamp(out[j].*colour + gain * slope / square, 0.0, 1.0);
    }
  return out;
}

}  // namespace conference_room
