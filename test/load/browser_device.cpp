// browser_device: what a page is measured with. Prints its port as JSON, then a line for each stop of its robot: when
// it came, in milliseconds since 1970. Runs until SIGTERM.
#include <chrono>
#include <iostream>
#include <string>

#include <nlohmann/json.hpp>

#include "node/service/node.hpp"

namespace {

constexpr std::chrono::milliseconds wire_period{10};
constexpr std::chrono::microseconds image_period{33'333};
constexpr int wires = 10;
constexpr int width = 640;
constexpr int height = 480;
constexpr int colours = 3;
constexpr int images_under_way = 2;

const std::string panels_definition = [] {
  std::string out = R"(service experimental.panels
stdver 0.10
struct Image
    field int32 width
    field int32 height
    field int32 step
    field uint8[] data
end
object Panels
    property double[] megabyte [readonly]
    function void nothing()
    pipe Image images [readonly]
)";
  for (int i = 0; i < wires; ++i) out += "    wire double w" + std::to_string(i) + " [readonly]\n";
  return out + "end\n";
}();

/// What the page of the demo robot needs; a call of it never ends.
constexpr const char* robot_definition = R"(service experimental.create
stdver 0.10
object Create
    property int32 DistanceTraveled [readonly]
    property int32 AngleTraveled [readonly]
    property uint8 Bumpers [readonly]
    function void Drive(int16 velocity, int16 radius)
    event Bump()
end
)";

class Panels {
 public:
  explicit Panels(rr::Node& node)
      : service_(rr::Service::from_text({panels_definition}, "Panels", "Panels")),
        megabyte_(1'000'000 / sizeof(double), 0.5),
        pixels_(std::size_t{width} * height * colours) {
    service_->property("megabyte").get([this] { return megabyte_; });
    service_->function("nothing", [] {});
    tick();
    node.add(service_);
    node.every(wire_period, [this] { tick(); });
    node.every(image_period, [this] { send_image(); });
  }

 private:
  void tick() {
    ++ticks_;
    for (int i = 0; i < wires; ++i)
      service_->set_wire("w" + std::to_string(i), static_cast<double>(ticks_ % (100 + i)));
  }

  void send_image() {
    for (auto& each : pixels_) ++each;  // a new one each time
    const rr::Structure image{"experimental.panels.Image",
                              {{"width", width}, {"height", height}, {"step", width * colours}, {"data", pixels_}}};
    service_->pipe("images").broadcast(image, images_under_way);
  }

  std::shared_ptr<rr::Service> service_;
  std::vector<double> megabyte_;
  std::vector<std::uint8_t> pixels_;
  std::int64_t ticks_ = 0;
};

class Robot {
 public:
  explicit Robot(rr::Node& node) : service_(rr::Service::from_text({robot_definition}, "Create", "Create")) {
    service_->property("DistanceTraveled").get([] { return std::int32_t{0}; });
    service_->property("AngleTraveled").get([this](const rr::Reply<std::int32_t>& reply) {
      hanging_.push_back(reply);
    });
    service_->property("Bumpers").get([] { return std::uint8_t{0}; });
    service_->function("Drive", [](std::int16_t velocity, std::int16_t) {
      if (velocity != 0) return;
      const auto now = std::chrono::system_clock::now().time_since_epoch();
      std::cout << std::chrono::duration<double, std::milli>(now).count() << std::endl;
    });
    node.add(service_);
  }

 private:
  std::vector<rr::Reply<std::int32_t>> hanging_;
  std::shared_ptr<rr::Service> service_;
};

}  // namespace

int main() {
  try {
    rr::Node node("test.browser.device");
    const Panels panels(node);
    const Robot robot(node);
    std::cout.precision(16);
    std::cout << nlohmann::json{{"port", node.listen("rr+tcp://127.0.0.1:0")}} << std::endl;
    node.run();
  } catch (const std::exception& failure) {
    std::cerr << "browser_device: " << failure.what() << '\n';
    return 1;
  }
}
