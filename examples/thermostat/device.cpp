// A thermostat in a simulated room.
#include <iostream>

#include "example__thermostat.hpp"
#include "rrgate/device.hpp"

namespace thermostat = example::thermostat;

class Room : public thermostat::ThermostatService {
 public:
  void step() {
    const bool heating = celsius_ < target_;
    if (heating) celsius_ += 0.5;
    if (heating && celsius_ >= target_) reached(celsius_);
    reading(thermostat::Reading{celsius_, heating});
  }

 private:
  double get_target() override { return target_; }
  void set_target(double value) override {
    if (value > 30) throw thermostat::TooHot("target " + std::to_string(value) + ", expected at most 30");
    target_ = value;
    if (celsius_ >= target_) reached(celsius_);
  }
  void cool(double degrees) override { celsius_ -= degrees; }

  double celsius_ = 17;
  double target_ = 17;
};

int main(int count, char** words) {
  rr::Node node("example.room");
  const auto room = std::make_shared<Room>();
  node.add(rr::make_service("Thermostat", room));
  node.every(std::chrono::milliseconds(10), [&] { room->step(); });
  const auto port = node.listen(count > 1 ? words[1] : "rr+tcp://127.0.0.1:52230");
  std::cout << "rr+tcp://127.0.0.1:" << port << "/?service=Thermostat" << std::endl;
  node.run();
}
