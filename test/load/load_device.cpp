// load_device: a device that sends on a wire and a pipe, and fires an event, at fixed rates. Prints its URL as JSON,
// runs until SIGTERM.
//   load_device [--rate HZ] [--packet-rate HZ] [--packet-bytes N] [--event-rate HZ]
#include <iostream>
#include <map>
#include <string>

#include <nlohmann/json.hpp>

#include "node/service/node.hpp"

namespace {

constexpr const char* definition = R"(service test.load
stdver 0.10
struct State
    field uint64 number
    field double[7] joints
end
struct Packet
    field uint64 number
    field uint8[] payload
end
object Arm
    wire State state [readonly]
end
object Load
    property uint64 number [readonly]
    objref Arm arm
    wire State state [readonly]
    pipe Packet packets [readonly]
    event moved(State state)
    function uint8[] many(uint32 count)
end
)";

class Load {
 public:
  Load(rr::Node& node, double rate, double packet_rate, std::size_t packet_bytes, double event_rate)
      : service_(rr::Service::from_text({definition}, "Load", "Load")),
        arm_(service_->make_object("Arm")),
        payload_(packet_bytes, 7) {
    service_->property("number").get([this] { return number_; });
    service_->objref("arm", arm_);
    service_->function("many", [](std::uint32_t count) { return std::vector<std::uint8_t>(count, 7); });
    tick();
    node.add(service_);
    if (rate > 0) node.every(period(rate), [this] { tick(); });
    if (packet_rate > 0) node.every(period(packet_rate), [this] { send_packet(); });
    if (event_rate > 0) node.every(period(event_rate), [this] { service_->fire("moved", next_state()); });
  }

 private:
  static std::chrono::nanoseconds period(double rate) {
    return std::chrono::nanoseconds(static_cast<std::int64_t>(1e9 / rate));
  }

  rr::Value next_state() {
    return rr::Value(rr::Structure{
        "test.load.State", {{"number", rr::Value(++number_)}, {"joints", rr::Value(std::vector<double>(7, 0.5))}}});
  }

  void tick() {
    const auto state = next_state();
    service_->set_wire("state", state);
    arm_->set_wire("state", state);
  }

  void send_packet() {
    const rr::Structure packet{"test.load.Packet",
                               {{"number", rr::Value(++packet_number_)}, {"payload", rr::Value(payload_)}}};
    service_->pipe("packets").broadcast(rr::Value(packet));
  }

  std::shared_ptr<rr::Service> service_;
  std::shared_ptr<rr::Object> arm_;
  std::vector<std::uint8_t> payload_;
  std::uint64_t number_ = 0;
  std::uint64_t packet_number_ = 0;
};

}  // namespace

int main(int argc, char** argv) {
  try {
    std::map<std::string, double> options{
        {"--rate", 100}, {"--packet-rate", 0}, {"--packet-bytes", 16384}, {"--event-rate", 0}};
    for (int i = 1; i < argc; i += 2) {
      const auto option = options.find(argv[i]);
      if (option == options.end() || i + 1 == argc)
        throw std::invalid_argument("found " + rr::quote(argv[i]) +
                                    ", expected --rate, --packet-rate, --packet-bytes or --event-rate with a number");
      option->second = std::stod(argv[i + 1]);
    }
    rr::Node node("test.load.device");
    const Load load(node, options.at("--rate"), options.at("--packet-rate"),
                    static_cast<std::size_t>(options.at("--packet-bytes")), options.at("--event-rate"));
    const auto port = node.listen("rr+tcp://127.0.0.1:0");
    std::cout << nlohmann::json{{"port", port},
                                {"url", "rr+tcp://127.0.0.1:" + std::to_string(port) + "/?service=Load"}}
              << std::endl;
    node.run();
  } catch (const std::exception& failure) {
    std::cerr << "load_device: " << failure.what() << '\n';
    return 1;
  }
}
