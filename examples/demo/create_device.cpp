#include "examples/demo/create_device.hpp"

#include <cmath>
#include <numbers>

#include "examples/demo/robdef_texts.hpp"

namespace rrgate::demo {

namespace {

constexpr std::chrono::milliseconds publish_period{50};
constexpr double metres = 0.001;  // per millimetre: the simulation's unit is the robot's, the service's is the metre

std::int32_t rounded(double value) {
  return static_cast<std::int32_t>(std::lround(value));
}

rr::Value to_state(const Robot& robot) {
  return rr::Structure{"experimental.simulatedcreate.RobotState",
                       {{"x", robot.pose().position.x * metres},
                        {"y", robot.pose().position.y * metres},
                        {"heading", robot.pose().heading},
                        {"velocity", robot.speed() * metres},
                        {"turn_rate", robot.turn_rate()},
                        {"bumpers", robot.bumpers()}}};
}

rr::Value to_list(const std::vector<Wall>& walls) {
  rr::List list;
  for (const Wall& wall : walls)
    list.items.push_back(rr::Structure{"experimental.simulatedcreate.Wall",
                                       {{"x1", wall.from.x * metres},
                                        {"y1", wall.from.y * metres},
                                        {"x2", wall.to.x * metres},
                                        {"y2", wall.to.y * metres},
                                        {"height", wall.height * metres}}});
  return list;
}

rr::Value to_list(const std::vector<Obstacle>& obstacles) {
  rr::List list;
  for (const Obstacle& obstacle : obstacles)
    list.items.push_back(rr::Structure{"experimental.simulatedcreate.Obstacle",
                                       {{"x", obstacle.center.x * metres},
                                        {"y", obstacle.center.y * metres},
                                        {"radius", obstacle.radius * metres},
                                        {"height", obstacle.height * metres}}});
  return list;
}

}  // namespace

CreateDevice::CreateDevice(rr::Node& node)
    : robot_(demo_world()),
      service_(rr::Service::from_text({std::string(robdef_create2), std::string(robdef_simulatedcreate)},
                                      std::string(service_name), "SimulatedCreate")) {
  add_members_of_create();
  add_members_of_simulation();
  node.add(service_);
  node.every(Robot::step, [this] {
    if (robot_.advance()) service_->fire("Bump");
  });
  node.every(publish_period, [this] { publish(); });
  publish();
}

void CreateDevice::add_members_of_create() {
  service_->function("Drive", [this](std::int16_t velocity, std::int16_t radius) {
    robot_.drive(velocity, radius);
    driver_ = service_->current_client();
  });
  // A robot that drives on after its driver is gone runs into things.
  service_->on_client_gone([this](rr::ClientId client) {
    if (client != driver_) return;
    robot_.drive(0, drive_straight);
    driver_ = 0;
  });
  service_->function("StartStreaming", [this] { is_streaming_ = true; });
  service_->function("StopStreaming", [this] { is_streaming_ = false; });
  service_->property("DistanceTraveled").get([this] { return rounded(robot_.distance()); });
  service_->property("AngleTraveled").get([this] { return rounded(robot_.angle() * 180 / std::numbers::pi); });
  service_->property("Bumpers").get([this] { return robot_.bumpers(); });
}

void CreateDevice::add_members_of_simulation() {
  service_->property("radius").get([] { return Robot::radius * metres; });
  service_->property("walls").get([this] { return to_list(robot_.world().walls); });
  service_->property("obstacles").get([this] { return to_list(robot_.world().obstacles); });
  service_->function("reset", [this] { robot_.place({}); });
  service_->function("press_play", [this] { press_play(); });
  service_->property("song").get([this] { return song_; });
}

void CreateDevice::press_play() {
  const rr::ClientId asked = driver_ != 0 ? driver_ : service_->current_client();
  service_->call_callback(asked, "play_callback",
                          {rounded(robot_.distance()), rounded(robot_.angle() * 180 / std::numbers::pi)},
                          [this](const rr::Result<rr::Value>& answer) {
                            if (!answer) return;  // a client that knows no song: the robot stays silent
                            const auto notes = answer->to_items<std::uint8_t>().value();
                            song_.assign(notes.begin(), notes.end());
                          });
}

void CreateDevice::publish() {
  service_->set_wire("state", to_state(robot_));
  if (!is_streaming_) return;
  service_->set_wire("packets", rr::Structure{"experimental.create2.SensorPacket",
                                              {{"ID", all_sensors}, {"Data", sensors_.next_packet(robot_)}}});
}

}  // namespace rrgate::demo
