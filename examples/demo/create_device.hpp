// The service of the demo robot: the Create of the Robot Raconteur paper's Example 1, simulated. Layer: demo.
// Definition: robdef/modern/experimental.simulatedcreate.robdef.
#pragma once

#include <memory>

#include "examples/demo/robot.hpp"
#include "examples/demo/sensor_packet.hpp"
#include "rrgate/device.hpp"

namespace rrgate::demo {

class CreateDevice {
 public:
  static constexpr std::string_view service_name = "Create";

  /// Adds the service to `node`, which must not run any more once the device is gone. The robot moves while it runs.
  explicit CreateDevice(rr::Node& node);
  CreateDevice(const CreateDevice&) = delete;
  CreateDevice& operator=(const CreateDevice&) = delete;

 private:
  void add_members_of_create();
  void add_members_of_simulation();
  void publish();
  void press_play();

  Robot robot_;
  SensorStream sensors_;
  bool is_streaming_ = true;
  rr::ClientId driver_ = 0;  ///< who sent the last Drive and is still there
  std::vector<std::uint8_t> song_;
  std::shared_ptr<rr::Service> service_;
};

}  // namespace rrgate::demo
