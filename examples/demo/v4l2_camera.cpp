#include "examples/demo/v4l2_camera.hpp"

#include <linux/videodev2.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <optional>
#include <system_error>

namespace rrgate::demo {

namespace {

constexpr std::uint32_t wanted_width = 640, wanted_height = 480;
constexpr std::uint32_t max_listed_formats = 64;
constexpr std::size_t max_found_cameras = 16;
/// A device that is broken may say that it has a frame, and have none, for ever.
constexpr int max_empty_wakes = 1000;

struct FormatCode {
  RawFormat format;
  std::uint32_t code;
};
/// Those without loss first.
constexpr std::array<FormatCode, 5> format_codes{{{RawFormat::yuyv, V4L2_PIX_FMT_YUYV},
                                                  {RawFormat::bgr24, V4L2_PIX_FMT_BGR24},
                                                  {RawFormat::rgb24, V4L2_PIX_FMT_RGB24},
                                                  {RawFormat::grey, V4L2_PIX_FMT_GREY},
                                                  {RawFormat::mjpeg, V4L2_PIX_FMT_MJPEG}}};

std::optional<RawFormat> format_of(std::uint32_t code) {
  for (const auto& each : format_codes)
    if (each.code == code) return each.format;
  return {};
}

std::string error_text(int error) {
  auto text = std::generic_category().message(error);
  if (error == EACCES || error == EPERM) text += "; is this user in the group 'video'?";
  if (error == EBUSY) text = "another program uses it";
  return text;
}

/// Text of a driver, which may lack the zero at its end.
template <std::size_t N>
std::string driver_text(const __u8 (&text)[N]) {
  const auto* const end = std::find(text, text + N, __u8{0});
  std::string printable(text, end);
  for (char& letter : printable)
    if (letter < ' ' || letter > '~') letter = '?';
  return printable;
}

std::uint32_t capabilities_of_device(const v4l2_capability& found) {
  return (found.capabilities & V4L2_CAP_DEVICE_CAPS) != 0 ? found.device_caps : found.capabilities;
}

bool is_capture_device(const v4l2_capability& found) {
  constexpr std::uint32_t needed = V4L2_CAP_VIDEO_CAPTURE | V4L2_CAP_STREAMING;
  return (capabilities_of_device(found) & needed) == needed;
}

/// The code of the first of ours that it offers; 0 where there is none.
std::uint32_t choose_format(V4l2System& system, int descriptor) {
  std::size_t best = format_codes.size();
  for (std::uint32_t i = 0; i < max_listed_formats; ++i) {
    v4l2_fmtdesc offered{};
    offered.index = i;
    offered.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
    if (system.control(descriptor, VIDIOC_ENUM_FMT, &offered) != 0) break;
    for (std::size_t each = 0; each < best; ++each)
      if (format_codes[each].code == offered.pixelformat) best = each;
  }
  return best < format_codes.size() ? format_codes[best].code : 0;
}

}  // namespace

FoundCameras find_cameras(V4l2System& system) {
  FoundCameras found;
  for (const auto& path : system.list()) {
    if (found.cameras.size() == max_found_cameras) break;
    const int descriptor = system.open(path);
    if (descriptor == -EACCES || descriptor == -EPERM)
      found.problems.push_back(path + " can't be opened: " + error_text(-descriptor));
    if (descriptor < 0) continue;
    v4l2_capability about{};
    if (system.control(descriptor, VIDIOC_QUERYCAP, &about) == 0 && is_capture_device(about) &&
        choose_format(system, descriptor) != 0)
      found.cameras.push_back({path, driver_text(about.card), driver_text(about.bus_info)});
    system.close(descriptor);
  }
  return found;
}

V4l2Camera::V4l2Camera(boost::asio::io_context& io, V4l2System& system, std::chrono::milliseconds deadline)
    : system_(system), deadline_(deadline), readable_(io), watch_(io) {}

V4l2Camera::~V4l2Camera() {
  stop();
}

std::string V4l2Camera::start(const std::string& path, Handlers handlers) {
  stop();
  path_ = path;
  auto problem = open();
  if (problem.empty()) problem = choose_layout();
  if (problem.empty()) problem = map_buffers();
  if (problem.empty()) problem = stream();
  if (!problem.empty()) {
    stop();
    return path_ + ' ' + problem;
  }
  run_ = std::make_shared<const Handlers>(std::move(handlers));
  last_frame_ = std::chrono::steady_clock::now();
  empty_wakes_ = 0;
  bad_frame_.clear();
  wait_for_frame();
  watch();
  return {};
}

void V4l2Camera::stop() {
  run_.reset();
  watch_.cancel();
  if (readable_.is_open()) readable_.release();
  if (descriptor_ < 0) return;
  int type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  system_.control(descriptor_, VIDIOC_STREAMOFF, &type);  // fails where the camera is gone, which is as good
  for (const auto& buffer : buffers_) system_.unmap(buffer.data, buffer.length);
  buffers_.clear();
  system_.close(descriptor_);
  descriptor_ = -1;
}

std::string V4l2Camera::open() {
  const int descriptor = system_.open(path_);
  if (descriptor < 0) return "can't be opened: " + error_text(-descriptor);
  descriptor_ = descriptor;
  v4l2_capability about{};
  if (const int error = system_.control(descriptor_, VIDIOC_QUERYCAP, &about))
    return "is no video device: " + error_text(error);
  return is_capture_device(about) ? "" : "is no camera: expected a video device that captures and streams";
}

std::string V4l2Camera::choose_layout() {
  v4l2_format format{};
  format.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  auto& picture = format.fmt.pix;
  picture.pixelformat = choose_format(system_, descriptor_);
  if (picture.pixelformat == 0) return "offers no format that is known here: YUYV, BGR24, RGB24, GREY or MJPEG";
  picture.width = wanted_width;
  picture.height = wanted_height;
  picture.field = V4L2_FIELD_NONE;
  if (const int error = system_.control(descriptor_, VIDIOC_S_FMT, &format))
    return "takes no format: " + error_text(error);

  // From here on the driver says what it will do, which need not be what it was asked for.
  const auto chosen = format_of(picture.pixelformat);
  if (!chosen) return "chose a format that it was not asked for";
  layout_ = {*chosen, picture.width, picture.height, picture.bytesperline};
  if (*chosen == RawFormat::yuyv) layout_.width &= ~1u;  // the last column of an odd width has half a colour
  if (auto problem = check_layout(layout_); !problem.empty()) return "offers what can't be used: " + problem;
  if (picture.sizeimage < needed_bytes(layout_) || picture.sizeimage > max_raw_bytes)
    return "says that a frame has " + std::to_string(picture.sizeimage) + " bytes, expected " +
           std::to_string(needed_bytes(layout_)) + " to " + std::to_string(max_raw_bytes);
  return {};
}

std::string V4l2Camera::map_buffers() {
  v4l2_requestbuffers request{};
  request.count = buffer_count;
  request.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  request.memory = V4L2_MEMORY_MMAP;
  if (const int error = system_.control(descriptor_, VIDIOC_REQBUFS, &request))
    return "gives no buffers: " + error_text(error);
  if (request.count == 0) return "gives no buffers: it is out of memory";
  for (std::uint32_t i = 0; i < std::min(request.count, buffer_count); ++i) {
    v4l2_buffer buffer{};
    buffer.index = i;
    buffer.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
    buffer.memory = V4L2_MEMORY_MMAP;
    if (const int error = system_.control(descriptor_, VIDIOC_QUERYBUF, &buffer))
      return "does not show its buffer: " + error_text(error);
    if (buffer.length < needed_bytes(layout_) || buffer.length > max_raw_bytes)
      return "has a buffer of " + std::to_string(buffer.length) + " bytes, expected " +
             std::to_string(needed_bytes(layout_)) + " to " + std::to_string(max_raw_bytes);
    void* const data = system_.map(descriptor_, buffer.length, buffer.m.offset);
    if (!data) return "has a buffer of " + std::to_string(buffer.length) + " bytes that can't be mapped";
    buffers_.push_back({data, buffer.length});
  }
  return {};
}

std::string V4l2Camera::stream() {
  for (std::uint32_t i = 0; i < buffers_.size(); ++i)
    if (const int error = queue(i)) return "takes no buffer: " + error_text(error);
  int type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  if (const int error = system_.control(descriptor_, VIDIOC_STREAMON, &type))
    return "does not start: " + error_text(error);
  boost::system::error_code failed;
  readable_.assign(descriptor_, failed);
  return failed ? "can't be waited for: " + failed.message() : "";
}

int V4l2Camera::queue(std::uint32_t index) {
  v4l2_buffer buffer{};
  buffer.index = index;
  buffer.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  buffer.memory = V4L2_MEMORY_MMAP;
  return system_.control(descriptor_, VIDIOC_QBUF, &buffer);
}

void V4l2Camera::wait_for_frame() {
  readable_.async_wait(boost::asio::posix::stream_descriptor::wait_read,
                       [this, run = std::weak_ptr(run_)](const boost::system::error_code& error) {
                         if (error == boost::asio::error::operation_aborted || run.expired()) return;
                         if (error) return lose("can't be waited for: " + error.message());
                         take_frames();
                       });
}

/// As many as there can be, so that a driver with ever more of them does not keep the thread.
void V4l2Camera::take_frames() {
  const std::weak_ptr run = run_;
  ++empty_wakes_;
  for (std::uint32_t i = 0; i < buffer_count; ++i) {
    v4l2_buffer buffer{};
    buffer.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
    buffer.memory = V4L2_MEMORY_MMAP;
    const int error = system_.control(descriptor_, VIDIOC_DQBUF, &buffer);
    if (error == EAGAIN) break;
    if (error != 0) return lose("gives no frame", error);
    if (buffer.index >= buffers_.size())
      return lose("filled its buffer " + std::to_string(buffer.index) + ", expected 0 to " +
                  std::to_string(buffers_.size() - 1));
    empty_wakes_ = 0;
    take_frame(buffer.index, buffer.flags, buffer.bytesused);
    if (run.expired()) return;
    if (const int refused = queue(buffer.index)) return lose("takes no buffer", refused);
  }
  if (empty_wakes_ > max_empty_wakes) return lose("says that it has a frame, and has none");
  wait_for_frame();
}

/// A frame that is not whole is left out: a camera may give some at its start, or after a disturbed transfer.
void V4l2Camera::take_frame(std::uint32_t index, std::uint32_t flags, std::uint32_t bytes) {
  const auto& buffer = buffers_[index];
  if ((flags & V4L2_BUF_FLAG_ERROR) != 0) {
    bad_frame_ = "the driver calls the last one damaged";
  } else if (bytes < needed_bytes(layout_) || bytes > buffer.length) {
    bad_frame_ = "the last one had " + std::to_string(bytes) + " bytes, expected " +
                 std::to_string(needed_bytes(layout_)) + " to " + std::to_string(buffer.length);
  } else {
    last_frame_ = std::chrono::steady_clock::now();
    bad_frame_.clear();
    const auto handlers = run_;
    handlers->on_frame({layout_, {static_cast<const std::uint8_t*>(buffer.data), bytes}});
  }
}

void V4l2Camera::watch() {
  watch_.expires_at(last_frame_ + deadline_);
  watch_.async_wait([this, run = std::weak_ptr(run_)](const boost::system::error_code& error) {
    if (error || run.expired()) return;
    if (std::chrono::steady_clock::now() < last_frame_ + deadline_) return watch();
    lose("has given no whole frame for " + std::to_string(deadline_.count()) + " ms" +
         (bad_frame_.empty() ? "" : "; " + bad_frame_));
  });
}

void V4l2Camera::lose(const char* request, int error) {
  lose(error == ENODEV ? "was unplugged" : request + (": " + error_text(error)));
}

void V4l2Camera::lose(const std::string& why) {
  const auto handlers = run_;
  stop();
  handlers->on_lost(path_ + ' ' + why);
}

}  // namespace rrgate::demo
