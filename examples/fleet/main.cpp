// rrgate-demo-fleet: many small devices in one process, each a node of its own. Layer: example.
//
//   rrgate-demo-fleet --port N [--port N]...
//
// There is one device for each port. Prints the URL of each whose port is 0: the system chooses it.
#include <sys/resource.h>

#include <deque>
#include <iostream>
#include <memory>
#include <string>
#include <vector>

#include "sensor.hpp"

namespace {

/// Each device takes a descriptor, and one more for each client: more than a process has at first.
void take_all_descriptors() {
  rlimit files{};
  if (::getrlimit(RLIMIT_NOFILE, &files) != 0) return;
  files.rlim_cur = files.rlim_max;
  ::setrlimit(RLIMIT_NOFILE, &files);
}

void run(const std::vector<std::string>& ports) {
  take_all_descriptors();
  std::vector<std::shared_ptr<fleet::Sensor>> sensors;
  rr::Node first("fleet.1");
  std::deque<rr::Node> others;  // on the thread of the first
  for (const auto& port : ports) {
    const auto number = static_cast<std::uint32_t>(sensors.size() + 1);
    auto& node = number == 1 ? first : others.emplace_back(first.io_context(), "fleet." + std::to_string(number));
    sensors.push_back(std::make_shared<fleet::Sensor>(number));
    node.add(rr::make_service("Sensor", sensors.back()));
    const auto bound = node.listen("rr+tcp://127.0.0.1:" + port);
    if (port == "0") std::cout << "rr+tcp://127.0.0.1:" << bound << "/?service=Sensor\n";
  }
  std::cout << std::flush;
  first.every(std::chrono::seconds(1), [&sensors, seconds = 0.0]() mutable {
    seconds += 1;
    for (const auto& sensor : sensors) sensor->measure(seconds);
  });
  first.run();
}

}  // namespace

int main(int count, char** words) {
  std::vector<std::string> ports;
  for (int i = 1; i + 1 < count && words[i] == std::string_view("--port"); i += 2) ports.emplace_back(words[i + 1]);
  if (ports.empty() || static_cast<std::size_t>(count) != 1 + 2 * ports.size()) {
    std::cerr << "usage: rrgate-demo-fleet --port N [--port N]... (0: the system chooses it)\n";
    return 2;
  }
  try {
    run(ports);
  } catch (const std::exception& failure) {
    std::cerr << "rrgate-demo-fleet: " << failure.what() << '\n';
    return 1;
  }
}
