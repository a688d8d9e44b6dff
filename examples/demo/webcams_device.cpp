#include "examples/demo/webcams_device.hpp"

#include "examples/demo/robdef_texts.hpp"

namespace rrgate::demo {

namespace {

constexpr std::chrono::milliseconds frame_period{100};
/// Frames on their way to one client; one that is slower than the camera misses some, and sees the newest.
constexpr std::int32_t max_frames_under_way = 2;

rr::Value to_value(Image image) {
  return rr::Structure{
      "experimental.createwebcam2.WebcamImage",
      {{"width", image.width}, {"height", image.height}, {"step", image.step}, {"data", std::move(image.data)}}};
}

/// The frame as the multi-dimensional memory has it: height x width x 3, red, green, blue; column-major.
std::vector<std::uint8_t> to_planes(const Image& image) {
  std::vector<std::uint8_t> planes;
  planes.reserve(image.data.size());
  for (int channel = 2; channel >= 0; --channel)
    for (int column = 0; column < image.width; ++column)
      for (int row = 0; row < image.height; ++row)
        planes.push_back(image.data[static_cast<std::size_t>(row * image.step + column * 3 + channel)]);
  return planes;
}

}  // namespace

WebcamsDevice::WebcamsDevice(rr::Node& node, std::function<Pose()> robot_pose)
    : world_(demo_world()),
      robot_pose_(std::move(robot_pose)),
      service_(rr::Service::from_text({std::string(robdef_createwebcam2)}, std::string(service_name), "WebcamHost")) {
  Camera left;
  left.offset = {90, 60};
  left.yaw = 0.15;
  Camera right;
  right.offset = {90, -60};
  right.yaw = -0.15;
  webcams_ = {{"Left", left}, {"Right", right}};
  for (Webcam& webcam : webcams_) webcam.object = make_object(webcam);

  service_->property("WebcamNames").get([this] {
    rr::MapInt32 names;
    for (std::size_t i = 0; i < webcams_.size(); ++i)
      names.items.emplace_back(static_cast<std::int32_t>(i), webcams_[i].name);
    return rr::Value(std::move(names));
  });
  service_->objref("Webcams", [this](std::string_view index) -> std::shared_ptr<rr::Object> {
    for (std::size_t i = 0; i < webcams_.size(); ++i)
      if (index == std::to_string(i)) return webcams_[i].object;
    return nullptr;
  });
  node.add(service_);
  node.every(frame_period, [this] { stream_frames(); });
}

rr::Value WebcamsDevice::capture(const Camera& camera) const {
  return to_value(render(world_, robot_pose_(), camera));
}

void WebcamsDevice::stream_frames() {
  for (const Webcam& webcam : webcams_) {
    if (!webcam.is_streaming) continue;
    auto frames = webcam.object->pipe("FrameStream");
    if (!frames.endpoints().empty()) frames.broadcast(capture(webcam.camera), max_frames_under_way);
  }
}

std::shared_ptr<rr::Object> WebcamsDevice::make_object(Webcam& webcam) {
  auto object = service_->make_object("Webcam");
  object->property("Name").get([name = webcam.name] { return name; });
  object->function("CaptureFrame", [this, camera = webcam.camera] { return capture(camera); });
  object->function("StartStreaming", [&webcam] { webcam.is_streaming = true; });
  object->function("StopStreaming", [&webcam] { webcam.is_streaming = false; });
  auto buffer = std::make_shared<rr::NumberMemory<std::uint8_t>>();
  auto planes = std::make_shared<rr::NumberMemory<std::uint8_t>>();
  planes->dimensions = {0, 0, 3};
  object->memory("buffer", buffer);
  object->memory("multidimbuffer", planes);
  object->function("CaptureFrameToBuffer", [this, camera = webcam.camera, buffer, planes] {
    Image image = render(world_, robot_pose_(), camera);
    planes->items = to_planes(image);
    planes->dimensions = {static_cast<std::uint64_t>(image.height), static_cast<std::uint64_t>(image.width), 3};
    buffer->dimensions = {image.data.size()};
    buffer->items = std::move(image.data);
    return rr::Value(rr::Structure{"experimental.createwebcam2.WebcamImage_size",
                                   {{"width", image.width}, {"height", image.height}, {"step", image.step}}});
  });
  return object;
}

}  // namespace rrgate::demo
