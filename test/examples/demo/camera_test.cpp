#include "examples/demo/camera.hpp"

#include <catch2/catch.hpp>
#include <cmath>

using namespace rrgate::demo;

namespace {

constexpr Color red{200, 0, 0};
constexpr Color green{0, 200, 0};

bool is_reddish(Color c) {
  return c.red > 2 * c.green && c.red > 2 * c.blue;
}
bool is_greenish(Color c) {
  return c.green > 2 * c.red && c.green > 2 * c.blue;
}

World wall_at(double x, double height = 500) {
  return {.walls = {{{x, -5000}, {x, 5000}, height, red}}, .obstacles = {}};
}

/// First and one-past-last row of a column where `is` holds.
template <class Predicate>
std::pair<int, int> rows_where(const Image& image, int column, Predicate is) {
  int first = 0;
  while (first < image.height && !is(image.at(column, first))) ++first;
  int last = first;
  while (last < image.height && is(image.at(column, last))) ++last;
  return {first, last};
}

}  // namespace

TEST_CASE("an image has the size that was asked for") {
  Camera camera;
  camera.width = 64;
  camera.height_pixels = 48;
  const Image image = render(World{}, Pose{}, camera);
  CHECK(image.width == 64);
  CHECK(image.height == 48);
  CHECK(image.step == 192);
  CHECK(image.data.size() == 192u * 48u);
}

TEST_CASE("a wall straight ahead is as high as perspective says, over the full width") {
  Camera camera;
  const Image image = render(wall_at(2000), Pose{}, camera);
  const double scale = camera.focal_length() / 2000;
  for (const int column : {0, 100, 160, 319}) {  // one depth: a wall across the view has straight edges
    const auto [top, bottom] = rows_where(image, column, is_reddish);
    CHECK(top == std::lround(120 - (500 - camera.height) * scale));
    CHECK(bottom == std::lround(120 + camera.height * scale));
  }
}

TEST_CASE("nearer is larger, and what is too near fills the image") {
  Camera camera;
  const auto far = rows_where(render(wall_at(3000), Pose{}, camera), 160, is_reddish);
  const auto near = rows_where(render(wall_at(1500), Pose{}, camera), 160, is_reddish);
  CHECK(near.second - near.first == Approx(2 * (far.second - far.first)).margin(1));
  const auto touching = rows_where(render(wall_at(170), Pose{}, camera), 160, is_reddish);
  CHECK(touching == std::pair{0, 240});
}

TEST_CASE("turning left moves things to the right") {
  const World world{.walls = {}, .obstacles = {{{2000, 0}, 100, 400, red}}};
  const auto column_of_obstacle = [&](double heading) {
    const Image image = render(world, Pose{{0, 0}, heading}, Camera{});
    int first = 0;
    while (first < image.width && !is_reddish(image.at(first, 115))) ++first;
    int last = first;
    while (last < image.width && is_reddish(image.at(last, 115))) ++last;
    return (first + last) / 2.0;
  };
  CHECK(column_of_obstacle(0) == Approx(160).margin(1));
  CHECK(column_of_obstacle(0.2) == Approx(160 + Camera{}.focal_length() * std::tan(0.2)).margin(2));
  CHECK(column_of_obstacle(-0.2) < 130);
}

TEST_CASE("two cameras see near things from different sides") {
  const World world{.walls = {}, .obstacles = {{{800, 0}, 60, 400, red}}};
  Camera left;
  left.offset = {0, 60};
  Camera right;
  right.offset = {0, -60};
  const auto first_column = [&](const Camera& camera) {
    const Image image = render(world, Pose{}, camera);
    int column = 0;
    while (column < image.width && !is_reddish(image.at(column, 115))) ++column;
    return column;
  };
  CHECK(first_column(left) > first_column(right) + 20);
}

TEST_CASE("the nearer thing hides the farther one, up to its own height") {
  World world = wall_at(2000, 600);
  world.obstacles = {{{1000, 0}, 200, 300, green}};
  const Image image = render(world, Pose{}, Camera{});
  const auto [top, bottom] = rows_where(image, 160, is_greenish);
  const double scale = Camera{}.focal_length() / 800;
  CHECK(top == Approx(120 - (300 - 220) * scale).margin(1));
  CHECK(bottom == 240 - (240 - std::min(240l, std::lround(120 + 220 * scale))));
  CHECK(is_reddish(image.at(160, top - 2)));
  CHECK(is_reddish(image.at(20, 115)));
}

TEST_CASE("nothing behind the camera is drawn; sky above, floor tiles below") {
  const Image image = render(wall_at(-500), Pose{}, Camera{});
  for (int column = 0; column < image.width; column += 10)
    for (int row = 0; row < image.height; row += 10) REQUIRE_FALSE(is_reddish(image.at(column, row)));
  CHECK(image.at(160, 0).blue > image.at(160, 0).red);
  int changes = 0;
  for (int row = 130; row + 1 < 240; ++row) changes += image.at(160, row) != image.at(160, row + 1) ? 1 : 0;
  CHECK(changes > 0);
}
