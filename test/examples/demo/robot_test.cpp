#include "examples/demo/robot.hpp"

#include <catch2/catch.hpp>
#include <cmath>
#include <numbers>
#include <random>

using namespace rrgate::demo;

namespace {

constexpr double pi = std::numbers::pi;

/// Returns how often a bumper was newly pressed.
int run(Robot& robot, double seconds) {
  int bumps = 0;
  const auto steps = std::lround(seconds / std::chrono::duration<double>(Robot::step).count());
  for (long i = 0; i < steps; ++i) bumps += robot.advance() ? 1 : 0;
  return bumps;
}

const World open_field;
World wall_ahead() {
  return {.walls = {{{500, -1000}, {500, 1000}, 500, {}}}, .obstacles = {}};
}

}  // namespace

TEST_CASE("straight ahead and back, with both straight radii") {
  Robot robot(open_field);
  robot.drive(200, drive_straight);
  run(robot, 3);
  CHECK(robot.pose().position.x == Approx(600));
  CHECK(robot.pose().position.y == Approx(0).margin(1e-9));
  CHECK(robot.distance() == Approx(600));
  CHECK(robot.angle() == 0);
  CHECK(robot.speed() == Approx(200));

  robot.drive(-100, drive_straight_too);
  run(robot, 1);
  CHECK(robot.pose().position.x == Approx(500));
  CHECK(robot.distance() == Approx(500));
}

TEST_CASE("it stands still until told to drive and after velocity 0") {
  Robot robot(open_field);
  run(robot, 1);
  CHECK(robot.distance() == 0);
  robot.drive(0, 700);
  run(robot, 1);
  CHECK(robot.distance() == 0);
  CHECK(robot.angle() == 0);
}

TEST_CASE("an arc has the commanded radius, positive to the left") {
  Robot robot(open_field);
  robot.drive(200, 600);
  const double quarter = 600 * pi / 2 / 200;
  run(robot, quarter);
  CHECK(robot.pose().position.x == Approx(600).margin(2));
  CHECK(robot.pose().position.y == Approx(600).margin(2));
  CHECK(robot.pose().heading == Approx(pi / 2).margin(0.01));
  CHECK(robot.distance() == Approx(600 * pi / 2).margin(2));

  Robot right(open_field);
  right.drive(200, -600);
  run(right, quarter);
  CHECK(right.pose().position.y == Approx(-600).margin(2));
  CHECK(right.angle() == Approx(-pi / 2).margin(0.01));
}

TEST_CASE("backwards on an arc turns the other way") {
  Robot robot(open_field);
  robot.drive(-200, 600);
  run(robot, 1);
  CHECK(robot.angle() < 0);
  CHECK(robot.pose().position.x < 0);
  CHECK(robot.pose().position.y > 0);
}

TEST_CASE("radii 1 and -1 spin on the spot") {
  Robot robot(open_field);
  robot.drive(129, spin_counterclockwise);
  run(robot, 1);
  CHECK(robot.angle() == Approx(1));  // half the wheel base is 129 mm
  CHECK(length(robot.pose().position) == Approx(0).margin(1e-9));
  CHECK(robot.distance() == Approx(0).margin(1e-9));
  robot.drive(129, spin_clockwise);
  run(robot, 3);
  CHECK(robot.angle() == Approx(-2));
}

TEST_CASE("headings wrap, the total angle does not") {
  Robot robot(open_field);
  robot.drive(129, spin_counterclockwise);
  run(robot, 10);
  CHECK(robot.angle() == Approx(10));
  CHECK(robot.pose().heading == Approx(10 - 4 * pi));
}

TEST_CASE("commands beyond the limits count as the limits, and tight arcs are slowed") {
  CHECK(wheel_speeds_for(32767, drive_straight).left == 500);
  CHECK(wheel_speeds_for(-32768, drive_straight).right == -500);
  const auto wide = wheel_speeds_for(100, 5000);
  CHECK(wide.left == Approx(100 * (2000 - 129.0) / 2000));
  const auto tight = wheel_speeds_for(500, 129);
  CHECK(tight.left == Approx(0).margin(1e-9));
  CHECK(tight.right == Approx(500));
  CHECK(wheel_speeds_for(100, 0).left == 100);
  CHECK(wheel_speeds_for(100, 0).right == 100);
}

TEST_CASE("a wall ahead stops it once, with both bumpers, at its own radius") {
  Robot robot(wall_ahead());
  robot.drive(300, drive_straight);
  CHECK(run(robot, 5) == 1);
  CHECK(robot.pose().position.x == Approx(500 - Robot::radius).margin(0.01));
  CHECK(robot.bumpers() == (Robot::left_bumper | Robot::right_bumper));
  CHECK(robot.speed() == Approx(0).margin(0.1));
  CHECK(robot.distance() == Approx(500 - Robot::radius).margin(0.01));

  robot.drive(-100, drive_straight);
  run(robot, 1);
  CHECK(robot.bumpers() == 0);
  robot.drive(300, drive_straight);
  CHECK(run(robot, 3) == 1);
}

TEST_CASE("the bumper on the side of the obstacle is pressed") {
  const auto bumpers_with_obstacle_at = [](Point center) {
    Robot robot(World{.walls = {}, .obstacles = {{center, 50, 300, {}}}});
    robot.drive(300, drive_straight);
    while (robot.bumpers() == 0 && robot.distance() < 1000) robot.advance();
    return robot.bumpers();
  };
  CHECK(bumpers_with_obstacle_at({400, 120}) == Robot::left_bumper);
  CHECK(bumpers_with_obstacle_at({400, -120}) == Robot::right_bumper);
  CHECK(bumpers_with_obstacle_at({400, 0}) == (Robot::left_bumper | Robot::right_bumper));
}

TEST_CASE("backing into something stops it without a bumper") {
  Robot robot(World{.walls = {{{-300, -500}, {-300, 500}, 500, {}}}, .obstacles = {}});
  robot.drive(-200, drive_straight);
  CHECK(run(robot, 3) == 0);
  CHECK(robot.pose().position.x == Approx(Robot::radius - 300).margin(0.01));
}

TEST_CASE("put elsewhere it stands still and keeps its totals") {
  Robot robot(wall_ahead());
  robot.drive(300, drive_straight);
  run(robot, 5);
  const double distance = robot.distance();
  robot.place({{-100, 50}, 1});
  CHECK(robot.bumpers() == 0);
  CHECK(run(robot, 1) == 0);
  CHECK(robot.pose().position == Point{-100, 50});
  CHECK(robot.pose().heading == Approx(1));
  CHECK(robot.distance() == distance);
}

TEST_CASE("it never gets into anything, whatever it is told") {
  const World world = demo_world();
  Robot robot(world);
  std::mt19937 random(7);
  std::uniform_int_distribution<int> velocity(-600, 600);
  std::uniform_int_distribution<int> radius(-2500, 2500);
  int bumps = 0;
  for (int command = 0; command < 2000; ++command) {
    const int kind = command % 4;
    robot.drive(static_cast<std::int16_t>(velocity(random)), kind == 0   ? drive_straight
                                                             : kind == 1 ? spin_clockwise
                                                                         : static_cast<std::int16_t>(radius(random)));
    for (int step = 0; step < 80; ++step) {
      bumps += robot.advance() ? 1 : 0;
      const auto inside = find_contacts(world, robot.pose().position, Robot::radius - 1e-6);
      if (!inside.empty()) FAIL("inside something at " << robot.pose().position.x << ", " << robot.pose().position.y);
      if (std::abs(robot.pose().position.x) > 2500 || std::abs(robot.pose().position.y) > 2000) FAIL("left the room");
    }
  }
  CHECK(bumps > 100);
}
