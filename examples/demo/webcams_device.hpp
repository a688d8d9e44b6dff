// The service of the webcams of the Robot Raconteur paper's Example 2: simulated on the demo robot, or those of this
// machine. Layer: demo. Definition: robdef/modern/experimental.createwebcam2.robdef.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "examples/demo/frame_source.hpp"
#include "examples/demo/robot.hpp"
#include "rrgate/device.hpp"

namespace rrgate::demo {

class WebcamsDevice {
 public:
  static constexpr std::string_view service_name = "Webcam";

  /// Adds the service to `node`, which must not run any more once the device is gone. Webcam 0 is the first source.
  WebcamsDevice(rr::Node& node, std::vector<std::unique_ptr<FrameSource>> sources);
  /// With two simulated cameras. `robot_pose` is asked for each frame.
  WebcamsDevice(rr::Node& node, const std::function<Pose()>& robot_pose);
  WebcamsDevice(const WebcamsDevice&) = delete;
  WebcamsDevice& operator=(const WebcamsDevice&) = delete;

 private:
  struct Webcam {
    std::unique_ptr<FrameSource> source;
    std::shared_ptr<rr::Object> object = {};
    bool is_streaming = false;
    bool has_request = false;  ///< of the stream, to the source
  };

  std::shared_ptr<rr::Object> make_object(Webcam& webcam);
  void stream_frames();
  void end_stream(Webcam& webcam);

  std::shared_ptr<rr::Service> service_;
  std::vector<Webcam> webcams_;  ///< by index of the objref Webcams; stays as it was made
};

}  // namespace rrgate::demo
