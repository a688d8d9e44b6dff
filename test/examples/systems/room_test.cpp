#include "examples/conference-room/room.hpp"

#include <catch2/catch.hpp>
#include <cmath>

using namespace conference_room;

namespace {

const Places lights = light_places();
const Places sensors = sensor_places();

/// After so many steps of the controller.
Colours settle(Colours levels, const Colour& daylight, const Colour& target, double gain, int steps) {
  for (int i = 0; i < steps; ++i)
    levels = follow(levels, lights, measure(levels, lights, sensors, daylight), sensors, target, gain);
  return levels;
}

double mean_red(const Colours& readings) {
  double sum = 0;
  for (const auto& each : readings) sum += each.red;
  return sum / static_cast<double>(readings.size());
}

}  // namespace

TEST_CASE("light adds up, and less of it reaches what is farther away") {
  Colours levels(lights.size());
  const auto dark = measure(levels, lights, sensors, {1, 2, 3});
  CHECK(dark == Colours(sensors.size(), {1, 2, 3}));
  levels[0].red = 0.5;
  const auto lit = measure(levels, lights, sensors, {1, 2, 3});
  for (std::size_t i = 0; i < sensors.size(); ++i) {
    CHECK(lit[i].red == Approx(1 + 0.5 * transport(lights[0], sensors[i])));
    CHECK(lit[i].blue == 3);
  }
  CHECK(transport({0, 0}, {0, 0}) == Approx(225));
  CHECK(transport({0, 0}, {2, 0}) == Approx(112.5));
}

TEST_CASE("the controller reaches a target that the lights allow, whatever it begins with and its gain is") {
  const Colour target{300, 250, 200};
  for (const double gain : {0.2, 1.0, 1.9})
    for (const double begin : {0.0, 1.0}) {
      const auto levels = settle(Colours(lights.size(), {begin, begin, begin}), {60, 60, 80}, target, gain, 200);
      const auto readings = measure(levels, lights, sensors, {60, 60, 80});
      CHECK(mean_red(readings) == Approx(300).epsilon(0.03));
      for (const auto& each : readings) CHECK(each.green == Approx(250).epsilon(0.15));
    }
}

TEST_CASE("lights go to their limits where the target is too bright, or the day is") {
  for (const auto& each : settle(Colours(lights.size()), {0, 0, 0}, {1000, 1000, 1000}, 1, 200))
    CHECK(each == Colour{1, 1, 1});
  for (const auto& each : settle(Colours(lights.size(), {1, 1, 1}), {500, 500, 500}, {100, 100, 100}, 1, 200))
    CHECK(each == Colour{0, 0, 0});
}
