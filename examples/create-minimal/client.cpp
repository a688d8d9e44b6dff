// Drives an iRobot Create for a second, and prints what its sensors say: create_client URL. Layer: example.
#include <csignal>
#include <iostream>

#include "rrgate/client.hpp"

namespace {

constexpr int speed = 100;       // mm/s
constexpr int straight = 32767;  // a radius that stands for none
constexpr int steps = 5;
constexpr std::chrono::milliseconds step{200};

volatile std::sig_atomic_t is_interrupted = 0;

void print_distance(const rr::RemoteObject& create) {
  std::cout << "DistanceTraveled: " << create.get("DistanceTraveled").to<int>().value() << " mm" << std::endl;
}

void print_packet(const rr::Value& value) {
  const auto* packet = value.get_if<rr::Structure>();
  const auto* id = packet ? packet->find("ID") : nullptr;
  const auto* data = packet ? packet->find("Data") : nullptr;
  if (!id || !data) throw std::runtime_error("packets: found " + value.type_text() + ", expected ID and Data");
  std::cout << "packet " << id->to<int>().value() << ":";
  for (const int byte : data->to_items<std::uint8_t>().value()) std::cout << ' ' << byte;
  std::cout << std::endl;
}

/// Stops the robot however the drive ends.
class Stop {
 public:
  explicit Stop(const rr::RemoteObject& create) : create_(create) {}
  Stop(const Stop&) = delete;
  Stop& operator=(const Stop&) = delete;
  ~Stop() {
    try {
      create_.call("Drive", 0, straight);
      create_.call("StopStreaming");
    } catch (const rr::Exception& failure) {
      std::cerr << "create_client: the robot was not told to stop: " << failure.what() << '\n';
    }
  }

 private:
  rr::RemoteObject create_;
};

void drive(const rr::RemoteObject& create) {
  const auto newest = std::make_shared<rr::Value>();
  create.on_event("Bump", [](std::span<const rr::Value>) { std::cout << "bump" << std::endl; });
  create.connect_wire("packets", [newest](const rr::Value& packet, rr::TimeSpec) { *newest = packet; });
  create.call("StartStreaming");

  const Stop stop(create);
  create.call("Drive", speed, straight);
  for (int i = 0; i < steps; ++i) {
    // Handlers of the event and of the wire are called while this waits.
    if (create.connection().run_until([] { return is_interrupted != 0; }, step)) break;
    if (!newest->is_null()) print_packet(*newest);
  }
}

}  // namespace

int main(int count, char** words) {
  if (count != 2) {
    std::cerr << "usage: create_client URL    as rr+tcp://127.0.0.1:52222/?service=Create\n";
    return 2;
  }
  try {
    const auto create = rr::connect(words[1]);
    print_distance(create);
    std::signal(SIGINT, [](int) { is_interrupted = 1; });  // Ctrl-C ends the drive
    drive(create);
    print_distance(create);
  } catch (const std::exception& failure) {
    std::cerr << "create_client: " << words[1] << ": " << failure.what() << '\n';
    return 1;
  }
  return 0;
}
