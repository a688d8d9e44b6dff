// rrgate-demo-fleet: many small devices in one process, each a node of its own. Layer: example.
//
//   rrgate-demo-fleet --port N|FIRST-LAST [--port ...]...
//
// There is one device for each port. Prints the URL of each whose port is 0: the system chooses it.
#include <sys/resource.h>

#include <charconv>
#include <cstdint>
#include <deque>
#include <iostream>
#include <memory>
#include <string>
#include <string_view>
#include <system_error>
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

/// Reads "5000", or "5000-5002" for three ports. Returns whether it is either.
bool add_ports(std::string_view text, std::vector<std::uint16_t>& ports) {
  const char* const end = text.data() + text.size();
  std::uint16_t first = 0;
  auto read = std::from_chars(text.data(), end, first);
  auto last = first;
  if (read.ec == std::errc() && read.ptr != end && *read.ptr == '-') read = std::from_chars(read.ptr + 1, end, last);
  if (read.ec != std::errc() || read.ptr != end || last < first) return false;
  for (std::uint32_t port = first; port <= last; ++port) ports.push_back(static_cast<std::uint16_t>(port));
  return true;
}

void run(const std::vector<std::uint16_t>& ports) {
  take_all_descriptors();
  std::vector<std::shared_ptr<fleet::Sensor>> sensors;
  rr::Node first("fleet.1");
  std::deque<rr::Node> others;  // on the thread of the first
  for (const auto port : ports) {
    const auto number = static_cast<std::uint32_t>(sensors.size() + 1);
    auto& node = number == 1 ? first : others.emplace_back(first.io_context(), "fleet." + std::to_string(number));
    sensors.push_back(std::make_shared<fleet::Sensor>(number));
    node.add(rr::make_service("Sensor", sensors.back()));
    const auto bound = node.listen("rr+tcp://127.0.0.1:" + std::to_string(port));
    if (port == 0) std::cout << "rr+tcp://127.0.0.1:" << bound << "/?service=Sensor\n";
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
  std::vector<std::uint16_t> ports;
  int read = 1;
  while (read + 1 < count && words[read] == std::string_view("--port") && add_ports(words[read + 1], ports)) read += 2;
  if (ports.empty() || read != count) {
    std::cerr << "usage: rrgate-demo-fleet --port N|FIRST-LAST [--port ...]... (0: the system chooses it)\n";
    return 2;
  }
  try {
    run(ports);
  } catch (const std::exception& failure) {
    std::cerr << "rrgate-demo-fleet: " << failure.what() << '\n';
    return 1;
  }
}
