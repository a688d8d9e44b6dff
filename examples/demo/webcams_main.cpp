// rrgate-demo-webcams: a Robot Raconteur node with two cameras on the demo robot. Layer: demo.
#include <iostream>

#include "examples/demo/options.hpp"
#include "examples/demo/pose_follower.hpp"
#include "examples/demo/webcams_device.hpp"

int main(int argc, char** argv) {
  using namespace rrgate::demo;
  int exit_code = 0;
  const auto options = parse_options({"rrgate-demo-webcams",
                                      "Two simulated webcams on the demo robot, for Robot Raconteur.",
                                      {"127.0.0.1", 52223, "rr+tcp://127.0.0.1:52222/?service=Create"}},
                                     argc, argv, exit_code);
  if (!options) return exit_code;
  try {
    rr::Node node("rrgate.demo.webcams");
    PoseFollower robot(node.io_context(), options->robot);
    const WebcamsDevice webcams(node, [&robot] { return robot.pose(); });
    const auto port = node.listen(listen_url(*options));
    std::cout << "webcams: " << service_url(options->host, port, WebcamsDevice::service_name) << std::endl;
    node.run();
  } catch (const std::exception& failure) {
    std::cerr << "rrgate-demo-webcams: " << failure.what() << '\n';
    return 1;
  }
}
