#include "examples/demo/camera_source.hpp"

#include <algorithm>
#include <utility>

#include "examples/demo/jpeg_picture.hpp"

namespace rrgate::demo {

namespace {

constexpr std::size_t max_waiting_requests = 256;
/// The first frames of a Motion JPEG camera are often damaged.
constexpr int max_unreadable_frames = 10;

}  // namespace

std::string find_again(const CameraIdentity& camera, FoundBy by, const std::vector<CameraIdentity>& present) {
  if (by == FoundBy::path) return camera.path;
  const auto is_it = [&](const CameraIdentity& each) {
    return each.name == camera.name && (by == FoundBy::name || each.port == camera.port);
  };
  std::string found;
  for (const auto& each : present) {
    if (!is_it(each)) continue;
    if (each.path == camera.path) return each.path;  // one camera may have several devices
    if (found.empty()) found = each.path;
  }
  return found;
}

CameraSource::CameraSource(boost::asio::io_context& io, V4l2System& system, CameraIdentity camera, FoundBy by,
                           Times times)
    : system_(system), camera_(std::move(camera)), by_(by), times_(times), device_(io, system, times.deadline) {}

void CameraSource::take(Taken taken) {
  last_request_ = Clock::now();
  if (waiting_.size() >= max_waiting_requests)
    return taken({{}, camera_.name + ": " + std::to_string(waiting_.size()) + " requests wait for a frame already"});
  if (!device_.is_on()) {
    if (failure_.empty() || last_request_ - failed_ >= times_.retry) {
      failure_ = switch_on();
      failed_ = last_request_;
    }
    if (!failure_.empty()) return taken({{}, failure_});
  }
  waiting_.push_back(std::move(taken));
}

std::string CameraSource::switch_on() {
  std::string path = camera_.path;
  if (by_ != FoundBy::path) path = find_again(camera_, by_, find_cameras(system_).cameras);
  if (path.empty()) return "camera '" + camera_.name + "' is not plugged in; it was " + camera_.path;
  unreadable_ = 0;
  return device_.start(
      path, {[this](const RawFrame& frame) { on_frame(frame); }, [this](const std::string& why) { on_lost(why); }});
}

void CameraSource::on_frame(const RawFrame& frame) {
  if (waiting_.empty()) {
    if (Clock::now() - last_request_ >= times_.idle) device_.stop();
    return;
  }
  auto result = frame.layout.format == RawFormat::mjpeg ? decode_jpeg(frame.bytes) : to_image(frame);
  if (!result.problem.empty()) {
    if (++unreadable_ < max_unreadable_frames) return;
    result.problem = "camera '" + camera_.name + "' gave " + std::to_string(unreadable_) +
                     " unreadable frames; in the last, " + result.problem;
  }
  unreadable_ = 0;
  answer(result);
}

void CameraSource::on_lost(const std::string& why) {
  failure_ = "camera '" + camera_.name + "' is lost: " + why;
  failed_ = Clock::now();
  answer({{}, failure_});
}

/// Requests that are made meanwhile wait for the next frame.
void CameraSource::answer(const FrameResult& result) {
  for (const auto& taken : std::exchange(waiting_, {})) taken(result);
}

}  // namespace rrgate::demo
