#include "examples/demo/create_device.hpp"

#include <catch2/catch.hpp>

#include "test/node/node/node_fixture.hpp"

using namespace rrgate::demo;
using namespace std::chrono_literals;

namespace {

struct RunningCreate {
  std::unique_ptr<CreateDevice> device;
  rr::RunningNode node{[this](rr::Node& made) { device = std::make_unique<CreateDevice>(made); }};
  rr::RemoteObject connect() const { return rr::connect(node.url("Create")); }
};

double number_in(const rr::Value& structure, std::string_view field) {
  return structure.get_if<rr::Structure>()->find(field)->to<double>().value();
}

}  // namespace

TEST_CASE("the robot drives, turns, and stands when it is told to") {
  const RunningCreate create;
  const auto robot = create.connect();
  CHECK(robot.type_name() == "experimental.simulatedcreate.SimulatedCreate");
  CHECK(robot.get("DistanceTraveled") == rr::Value(std::int32_t{0}));
  rr::Value state;
  robot.connect_wire("state", [&](const rr::Value& newer, rr::TimeSpec) { state = newer; });
  robot.call("Drive", 200, drive_straight);
  REQUIRE(robot.connection().run_until([&] { return !state.is_null() && number_in(state, "x") > 0.02; }, 5s));
  CHECK(number_in(state, "velocity") == Approx(0.2));
  CHECK(robot.get("DistanceTraveled").to<std::int32_t>().value() >= 20);

  robot.call("Drive", 200, spin_counterclockwise);
  REQUIRE(robot.connection().run_until([&] { return number_in(state, "heading") > 0.1; }, 5s));
  CHECK(robot.get("AngleTraveled").to<std::int32_t>().value() >= 5);

  robot.call("reset");
  REQUIRE(robot.connection().run_until([&] { return number_in(state, "x") == 0; }, 5s));
  CHECK(number_in(state, "heading") == 0);
  CHECK(robot.get("Bumpers") == rr::Value(std::uint8_t{0}));
}

TEST_CASE("sensor packets flow until they are stopped") {
  const RunningCreate create;
  const auto robot = create.connect();
  int packets = 0;
  robot.connect_wire("packets", [&](const rr::Value& packet, rr::TimeSpec) {
    ++packets;
    CHECK(number_in(packet, "ID") == all_sensors);
    CHECK(packet.get_if<rr::Structure>()->find("Data")->get_if<rr::Array>()->size() == 52);
  });
  REQUIRE(robot.connection().run_until([&] { return packets >= 3; }, 5s));
  robot.call("StopStreaming");
  const int stopped_at = packets;
  int states = 0;
  robot.connect_wire("state", [&](const rr::Value&, rr::TimeSpec) { ++states; });
  REQUIRE(robot.connection().run_until([&] { return states >= 4; }, 5s));
  CHECK(packets == stopped_at);
  robot.call("StartStreaming");
  REQUIRE(robot.connection().run_until([&] { return packets > stopped_at; }, 5s));
}

TEST_CASE("the room is told in metres") {
  const RunningCreate create;
  const auto robot = create.connect();
  CHECK(robot.get("radius") == rr::Value(0.165));
  const auto walls = robot.get("walls");
  REQUIRE(walls.get_if<rr::List>()->items.size() == demo_world().walls.size());
  CHECK(number_in(walls.get_if<rr::List>()->items.front(), "x1") == Approx(-2.5));
  const auto obstacles = robot.get("obstacles");
  REQUIRE(obstacles.get_if<rr::List>()->items.size() == demo_world().obstacles.size());
  CHECK(number_in(obstacles.get_if<rr::List>()->items.front(), "radius") == Approx(0.2));
}

TEST_CASE("the robot stops when the client that drove it is gone, and not for another one") {
  const RunningCreate create;
  const auto watcher = create.connect();
  double velocity = 0;
  watcher.connect_wire("state", [&](const rr::Value& state, rr::TimeSpec) { velocity = number_in(state, "velocity"); });
  {
    const auto driver = create.connect();
    driver.call("Drive", -50, drive_straight);
    { const auto bystander = create.connect(); }
    REQUIRE(watcher.connection().run_until([&] { return velocity < -0.04; }, 5s));
  }
  REQUIRE(watcher.connection().run_until([&] { return velocity == 0; }, 5s));
}

TEST_CASE("the play button asks the driver for a song, or who presses it while nobody drives") {
  const RunningCreate create;
  const auto driver = create.connect();
  const auto other = create.connect();
  using Notes = std::vector<std::uint8_t>;
  const auto song_is = [](const rr::RemoteObject& robot, const Notes& notes) {
    const auto deadline = std::chrono::steady_clock::now() + 5s;
    while (std::chrono::steady_clock::now() < deadline)
      if (robot.get("song") == rr::Value(notes)) return true;
    return false;
  };
  other.on_callback("play_callback", [](std::int32_t, std::int32_t) { return Notes{72, 16}; });
  other.call("press_play");
  CHECK(song_is(other, {72, 16}));

  driver.on_callback("play_callback", [](std::int32_t distance, std::int32_t angle) {
    CHECK(distance == 0);
    CHECK(angle == 0);
    return Notes{60, 32, 64, 32};
  });
  driver.call("Drive", 0, drive_straight);
  other.call("press_play");
  CHECK(song_is(driver, {60, 32, 64, 32}));
}
