// rrgate-demo-conference-room: four nodes in one process. Layer: example.
//
//   rrgate-demo-conference-room [--port N]... [--sensors URL]...
//
// Ports are those of the controller, the lights, the northern and the southern sensors. The controller also follows the
// sensors of each URL while they are there.
#include <array>
#include <iostream>

#include "controller.hpp"
#include "devices.hpp"

namespace {

using namespace conference_room;

void run(const std::array<std::string, 4>& ports, const std::vector<std::string>& guests) {
  const auto lights = std::make_shared<Lights>();
  const auto places = sensor_places();
  const auto half = places.begin() + static_cast<std::ptrdiff_t>(places.size() / 2);
  const auto north = std::make_shared<Sensors>(Places(places.begin(), half));
  const auto south = std::make_shared<Sensors>(Places(half, places.end()));

  rr::Node controller_node("room.controller");
  rr::Node light_node(controller_node.io_context(), "room.lights");
  rr::Node north_node(controller_node.io_context(), "room.sensors.north");
  rr::Node south_node(controller_node.io_context(), "room.sensors.south");
  light_node.add(rr::make_service("Lights", lights));
  north_node.add(rr::make_service("Sensors", north));
  south_node.add(rr::make_service("Sensors", south));
  const auto listen = [](rr::Node& node, const std::string& port, const std::string& service) {
    const auto bound = node.listen("rr+tcp://127.0.0.1:" + port);
    return "rr+tcp://127.0.0.1:" + std::to_string(bound) + "/?service=" + service;
  };
  const auto lights_url = listen(light_node, ports[1], "Lights");
  const auto north_url = listen(north_node, ports[2], "Sensors");
  const auto south_url = listen(south_node, ports[3], "Sensors");

  // The controller knows the devices by their URLs alone: it could run on another machine.
  const auto controller =
      std::make_shared<Controller>(controller_node.io_context(), lights_url, std::vector{north_url, south_url}, guests);
  controller_node.add(rr::make_service("Controller", controller));
  std::cout << "controller: " << listen(controller_node, ports[0], "Controller") << "\nlights: " << lights_url
            << "\nsensors: " << north_url << " " << south_url << std::endl;

  light_node.every(std::chrono::milliseconds(50), [&] {
    lights->publish();
    north->publish(*lights);
    south->publish(*lights);
  });
  controller_node.every(std::chrono::milliseconds(100), [&] { controller->step(); });
  controller_node.run();
}

}  // namespace

int main(int count, char** words) {
  std::array<std::string, 4> ports;
  ports.fill("0");
  std::vector<std::string> guests;
  std::size_t given = 0;
  for (int i = 1; i < count; i += 2) {
    const std::string_view word = words[i];
    const bool is_port = word == "--port" && given < ports.size();
    if (i + 1 == count || (!is_port && word != "--sensors")) {
      std::cerr << "usage: rrgate-demo-conference-room [--port N]... (four at most) [--sensors URL]...\n";
      return 2;
    }
    if (is_port)
      ports[given++] = words[i + 1];
    else
      guests.emplace_back(words[i + 1]);
  }
  try {
    run(ports, guests);
  } catch (const std::exception& failure) {
    std::cerr << "rrgate-demo-conference-room: " << failure.what() << '\n';
    return 1;
  }
}
