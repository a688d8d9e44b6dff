#include "examples/demo/sensor_packet.hpp"

#include <catch2/catch.hpp>

using namespace rrgate::demo;

namespace {

int read16(const std::vector<std::uint8_t>& bytes, std::size_t at) {
  return static_cast<std::int16_t>(bytes.at(at) << 8 | bytes.at(at + 1));
}

}  // namespace

TEST_CASE("a packet holds all sensors at their places") {
  Robot robot(World{.walls = {{{400, -500}, {400, 500}, 500, {}}}, .obstacles = {}});
  SensorStream stream;
  CHECK(stream.next_packet(robot).size() == 52);

  robot.drive(100, -2000);
  for (int i = 0; i < 50; ++i) robot.advance();
  const auto driving = stream.next_packet(robot);
  CHECK(driving.at(0) == 0);
  CHECK(read16(driving, 12) == 50);  // distance since the last packet
  CHECK(read16(driving, 14) == -1);  // angle: 1.4 degrees to the right
  CHECK(read16(driving, 17) == 16100);
  CHECK(read16(driving, 44) == 100);  // commanded velocity and radius
  CHECK(read16(driving, 46) == -2000);
  CHECK(read16(driving, 48) == 94);  // right wheel, left wheel
  CHECK(read16(driving, 50) == 106);

  robot.drive(500, 32767);
  for (int i = 0; i < 100; ++i) robot.advance();
  const auto blocked = stream.next_packet(robot);
  CHECK(blocked.at(0) == 3);
  CHECK(read16(blocked, 12) == 185);
}

TEST_CASE("nothing is lost between packets by rounding") {
  Robot robot{World{}};
  robot.drive(33, 32767);
  SensorStream stream;
  int total = 0;
  for (int packet = 0; packet < 200; ++packet) {
    for (int i = 0; i < 5; ++i) robot.advance();
    total += read16(stream.next_packet(robot), 12);
  }
  CHECK(total == 330);
}
