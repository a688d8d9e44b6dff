#include "examples/demo/world.hpp"

#include <catch2/catch.hpp>

#include "examples/demo/robot.hpp"

using namespace rrgate::demo;

TEST_CASE("a wall is felt at its nearest point, beside and beyond its ends") {
  const World world{.walls = {{{0, 0}, {100, 0}, 500, {}}}, .obstacles = {}};

  const auto above = find_contacts(world, {50, 30}, 40);
  REQUIRE(above.size() == 1);
  CHECK(above[0].distance == Approx(30));
  CHECK(above[0].normal.x == Approx(0).margin(1e-12));
  CHECK(above[0].normal.y == Approx(1));

  const auto beyond = find_contacts(world, {103, 4}, 40);
  REQUIRE(beyond.size() == 1);
  CHECK(beyond[0].distance == Approx(5));
  CHECK(beyond[0].normal.x == Approx(0.6));

  CHECK(find_contacts(world, {50, 41}, 40).empty());
}

TEST_CASE("inside an obstacle the distance is negative and the normal points out") {
  const World world{.walls = {}, .obstacles = {{{0, 0}, 50, 300, {}}}};
  const auto contacts = find_contacts(world, {0, 20}, 0);
  REQUIRE(contacts.size() == 1);
  CHECK(contacts[0].distance == Approx(-30));
  CHECK(contacts[0].normal.y == Approx(1));
}

TEST_CASE("the demo room leaves the robot's start clear") {
  CHECK(find_contacts(demo_world(), {0, 0}, Robot::radius + 500).empty());
}
