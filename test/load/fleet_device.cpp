// fleet_device: many small devices in one process, each a node of its own. Prints their ports as a JSON array, runs
// until SIGTERM.
//   fleet_device COUNT
#include <iostream>
#include <memory>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "node/service/node.hpp"

namespace {

constexpr const char* definition = R"(service test.fleet
stdver 0.10
object Sensor
    property double value [readonly]
end
)";

}  // namespace

int main(int argc, char** argv) {
  try {
    if (argc != 2) throw std::invalid_argument("expected the number of devices");
    const auto count = std::stoul(argv[1]);
    std::vector<std::unique_ptr<rr::Node>> nodes;
    auto ports = nlohmann::json::array();
    rr::Node first("test.fleet.0");
    for (std::size_t i = 0; i < count; ++i) {
      if (i > 0) nodes.push_back(std::make_unique<rr::Node>(first.io_context(), "test.fleet." + std::to_string(i)));
      auto& node = i == 0 ? first : *nodes.back();
      const auto service = rr::Service::from_text({definition}, "Sensor", "Sensor");
      service->property("value").get([i] { return static_cast<double>(i); });
      node.add(service);
      ports.push_back(node.listen("rr+tcp://127.0.0.1:0"));
    }
    std::cout << ports.dump() << std::endl;
    first.run();
  } catch (const std::exception& failure) {
    std::cerr << "fleet_device: " << failure.what() << '\n';
    return 1;
  }
}
