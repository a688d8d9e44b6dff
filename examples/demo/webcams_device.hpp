// The service of the demo cameras: the webcams of the Robot Raconteur paper's Example 2, on the demo robot. Layer:
// demo. Definition: robdef/modern/experimental.createwebcam2.robdef.
#pragma once

#include <functional>
#include <memory>
#include <vector>

#include "examples/demo/camera.hpp"
#include "rrgate/device.hpp"

namespace rrgate::demo {

class WebcamsDevice {
 public:
  static constexpr std::string_view service_name = "Webcam";

  /// Adds the service to `node`, which must not run any more once the device is gone. `robot_pose` is asked for each
  /// frame.
  WebcamsDevice(rr::Node& node, std::function<Pose()> robot_pose);
  WebcamsDevice(const WebcamsDevice&) = delete;
  WebcamsDevice& operator=(const WebcamsDevice&) = delete;

 private:
  struct Webcam {
    std::string name;
    Camera camera;
    std::shared_ptr<rr::Object> object = {};
    bool is_streaming = false;
  };

  std::shared_ptr<rr::Object> make_object(Webcam& webcam);
  rr::Value capture(const Camera& camera) const;
  void stream_frames();

  World world_;
  std::function<Pose()> robot_pose_;
  std::shared_ptr<rr::Service> service_;
  std::vector<Webcam> webcams_;  ///< by index of the objref Webcams
};

}  // namespace rrgate::demo
