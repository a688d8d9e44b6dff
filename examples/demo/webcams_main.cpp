// rrgate-demo-webcams: a Robot Raconteur node with the cameras of this machine, with pictures out of files, or with two
// cameras on the demo robot. Layer: demo.
#include <algorithm>
#include <iostream>
#include <optional>

#include "examples/demo/camera_source.hpp"
#include "examples/demo/options.hpp"
#include "examples/demo/picture_files.hpp"
#include "examples/demo/pose_follower.hpp"
#include "examples/demo/webcams_device.hpp"

namespace {

using namespace rrgate::demo;
using Sources = std::vector<std::unique_ptr<FrameSource>>;

Sources open_named_cameras(const std::vector<std::string>& paths, rr::Node& node, V4l2System& system) {
  Sources sources;
  for (const auto& path : paths)
    sources.push_back(
        std::make_unique<CameraSource>(node.io_context(), system, CameraIdentity{path, path, {}}, FoundBy::path));
  return sources;
}

Sources open_all_cameras(rr::Node& node, V4l2System& system) {
  const auto found = find_cameras(system);
  for (const auto& problem : found.problems) std::cerr << "rrgate-demo-webcams: " << problem << '\n';
  Sources sources;
  for (const auto& camera : found.cameras) {
    const auto of_its_name = std::count_if(found.cameras.begin(), found.cameras.end(),
                                           [&](const auto& each) { return each.name == camera.name; });
    sources.push_back(std::make_unique<CameraSource>(node.io_context(), system, camera,
                                                     of_its_name == 1 ? FoundBy::name : FoundBy::port));
  }
  return sources;
}

/// None: the cameras are to be simulated. Throws std::runtime_error: there are no such pictures.
Sources open_sources(const Options& options, rr::Node& node, V4l2System& system) {
  if (!options.pictures.empty()) {
    std::string problem;
    Sources sources;
    sources.push_back(open_picture_files(options.pictures, problem));
    if (!sources.front()) throw std::runtime_error(problem);
    return sources;
  }
  if (options.is_on_robot) return {};
  if (options.devices.empty()) {
    if (is_loopback(options.host)) return open_all_cameras(node, system);
    std::cerr
        << "rrgate-demo-webcams: the cameras are simulated, since other machines can connect; --device auto shows "
           "those of this machine\n";
    return {};
  }
  if (options.devices.front() == no_device) return {};
  if (options.devices.front() == all_devices) return open_all_cameras(node, system);
  return open_named_cameras(options.devices, node, system);
}

}  // namespace

int main(int argc, char** argv) {
  int exit_code = 0;
  const auto options = parse_options({"rrgate-demo-webcams",
                                      "The webcams of this machine, or two simulated ones on the demo robot, for Robot "
                                      "Raconteur.",
                                      {"127.0.0.1", 52223, "rr+tcp://127.0.0.1:52222/?service=Create"}},
                                     argc, argv, exit_code);
  if (!options) return exit_code;
  try {
    LinuxV4l2 system;
    rr::Node node("rrgate.demo.webcams");
    auto sources = open_sources(*options, node, system);
    std::vector<std::string> names;
    for (const auto& source : sources) names.push_back(source->name());
    std::optional<PoseFollower> robot;
    std::optional<WebcamsDevice> webcams;
    if (sources.empty()) {
      robot.emplace(node.io_context(), options->robot);
      webcams.emplace(node, [&robot] { return robot->pose(); });
    } else {
      webcams.emplace(node, std::move(sources));
    }
    const auto port = node.listen(listen_url(*options));
    std::cout << "webcams: " << service_url(options->host, port, WebcamsDevice::service_name) << std::endl;
    for (std::size_t i = 0; i < names.size(); ++i) std::cout << "webcam " << i << ": " << names[i] << std::endl;
    node.run();
  } catch (const std::exception& failure) {
    std::cerr << "rrgate-demo-webcams: " << failure.what() << '\n';
    return 1;
  }
}
