#include "examples/demo/webcams_device.hpp"

#include <iostream>
#include <utility>

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
  const auto step = static_cast<std::size_t>(image.step);
  for (int channel = 2; channel >= 0; --channel)
    for (int column = 0; column < image.width; ++column)
      for (int row = 0; row < image.height; ++row)
        planes.push_back(
            image.data[static_cast<std::size_t>(row) * step + static_cast<std::size_t>(column * 3 + channel)]);
  return planes;
}

rr::Error no_frame(const std::string& why) {
  return rr::make_error(rr::ErrorCode::operation_failed, why);
}

class SimulatedCamera : public FrameSource {
 public:
  SimulatedCamera(std::string name, const Camera& camera, std::function<Pose()> robot_pose)
      : name_(std::move(name)), world_(demo_world()), camera_(camera), robot_pose_(std::move(robot_pose)) {}

  std::string name() const override { return name_; }
  void take(Taken taken) override { taken({render(world_, robot_pose_(), camera_), {}}); }

 private:
  std::string name_;
  World world_;
  Camera camera_;
  std::function<Pose()> robot_pose_;
};

std::vector<std::unique_ptr<FrameSource>> simulate_cameras(const std::function<Pose()>& robot_pose) {
  Camera left;
  left.offset = {90, 60};
  left.yaw = 0.15;
  Camera right;
  right.offset = {90, -60};
  right.yaw = -0.15;
  std::vector<std::unique_ptr<FrameSource>> cameras;
  cameras.push_back(std::make_unique<SimulatedCamera>("Left", left, robot_pose));
  cameras.push_back(std::make_unique<SimulatedCamera>("Right", right, robot_pose));
  return cameras;
}

}  // namespace

WebcamsDevice::WebcamsDevice(rr::Node& node, const std::function<Pose()>& robot_pose)
    : WebcamsDevice(node, simulate_cameras(robot_pose)) {}

WebcamsDevice::WebcamsDevice(rr::Node& node, std::vector<std::unique_ptr<FrameSource>> sources)
    : service_(rr::Service::from_text({std::string(robdef_createwebcam2)}, std::string(service_name), "WebcamHost")) {
  for (auto& source : sources) webcams_.push_back({std::move(source)});
  for (Webcam& webcam : webcams_) webcam.object = make_object(webcam);

  service_->property("WebcamNames").get([this] {
    rr::MapInt32 names;
    for (std::size_t i = 0; i < webcams_.size(); ++i)
      names.items.emplace_back(static_cast<std::int32_t>(i), webcams_[i].source->name());
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

/// A source that is slow is asked for one frame at a time.
void WebcamsDevice::stream_frames() {
  for (Webcam& webcam : webcams_) {
    if (!webcam.is_streaming || webcam.has_request || webcam.object->pipe("FrameStream").endpoints().empty()) continue;
    webcam.has_request = true;
    webcam.source->take([this, &webcam](FrameResult frame) {
      webcam.has_request = false;
      if (!webcam.is_streaming) return;
      if (!frame.problem.empty()) {
        std::cerr << "webcams: " << frame.problem << std::endl;
        return end_stream(webcam);
      }
      webcam.object->pipe("FrameStream").broadcast(to_value(std::move(frame.image)), max_frames_under_way);
    });
  }
}

/// A pipe carries no errors: its clients hear that it ends, and the reason when they start it again.
void WebcamsDevice::end_stream(Webcam& webcam) {
  webcam.is_streaming = false;
  const auto endpoints = webcam.object->pipe("FrameStream").endpoints();  // close() takes them out of the list
  for (const auto& endpoint : endpoints) endpoint.close();
}

std::shared_ptr<rr::Object> WebcamsDevice::make_object(Webcam& webcam) {
  auto object = service_->make_object("Webcam");
  object->property("Name").get([name = webcam.source->name()] { return name; });
  object->function("CaptureFrame", [&webcam](const rr::Reply<>& reply) {
    webcam.source->take([reply](FrameResult frame) {
      if (!frame.problem.empty()) return reply.fail(no_frame(frame.problem));
      reply(to_value(std::move(frame.image)));
    });
  });
  object->function("StartStreaming", [this, &webcam](const rr::Reply<void>& reply) {
    // At once: a StopStreaming that comes before the first frame holds.
    const bool was_streaming = std::exchange(webcam.is_streaming, true);
    webcam.source->take([this, &webcam, reply, was_streaming](const FrameResult& frame) {
      if (frame.problem.empty()) return reply();
      reply.fail(no_frame(frame.problem));
      webcam.is_streaming = false;
      if (was_streaming) end_stream(webcam);
    });
  });
  object->function("StopStreaming", [&webcam] { webcam.is_streaming = false; });
  auto buffer = std::make_shared<rr::NumberMemory<std::uint8_t>>();
  auto planes = std::make_shared<rr::NumberMemory<std::uint8_t>>();
  planes->dimensions = {0, 0, 3};
  object->memory("buffer", buffer);
  object->memory("multidimbuffer", planes);
  object->function("CaptureFrameToBuffer", [&webcam, buffer, planes](const rr::Reply<>& reply) {
    webcam.source->take([reply, buffer, planes](FrameResult frame) {
      if (!frame.problem.empty()) return reply.fail(no_frame(frame.problem));
      Image& image = frame.image;
      planes->items = to_planes(image);
      planes->dimensions = {static_cast<std::uint64_t>(image.height), static_cast<std::uint64_t>(image.width), 3};
      buffer->dimensions = {image.data.size()};
      buffer->items = std::move(image.data);
      reply(rr::Structure{"experimental.createwebcam2.WebcamImage_size",
                          {{"width", image.width}, {"height", image.height}, {"step", image.step}}});
    });
  });
  return object;
}

}  // namespace rrgate::demo
