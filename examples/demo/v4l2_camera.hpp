// A camera of this machine by Video4Linux: which there are, and the frames of one. Layer: demo.
// Source: Linux media documentation, "Video Capture Interface" and "Streaming I/O (Memory Mapping)".
#pragma once

#include <boost/asio/io_context.hpp>
#include <boost/asio/posix/stream_descriptor.hpp>
#include <boost/asio/steady_timer.hpp>
#include <chrono>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "examples/demo/raw_frame.hpp"
#include "examples/demo/v4l2_system.hpp"

namespace rrgate::demo {

/// What tells one camera from another.
struct CameraIdentity {
  std::string path;  ///< "/dev/video0"
  std::string name;  ///< "Integrated Camera", as the driver says; printable ASCII
  std::string port;  ///< "usb-0000:00:14.0-8": where it is plugged in; printable ASCII
  bool operator==(const CameraIdentity&) const = default;
};

struct FoundCameras {
  std::vector<CameraIdentity> cameras;  ///< 16 at most
  std::vector<std::string> problems;    ///< a sentence for each device that this user may not open
};

/// The video devices that capture, stream, and offer a RawFormat. No camera is switched on for that.
FoundCameras find_cameras(V4l2System& system);

/// One camera, which is on from start() to stop(). For the thread that runs `io`.
class V4l2Camera {
 public:
  static constexpr std::uint32_t buffer_count = 4;

  struct Handlers {
    /// A whole frame; its bytes are borrowed for the call. May call stop().
    std::function<void(const RawFrame&)> on_frame;
    /// Once, after the camera was stopped by itself: a sentence that says why. May call start().
    std::function<void(const std::string& why)> on_lost;
  };

  /// `system` and `io` outlive the camera. A camera that gives no whole frame for `deadline` is lost. The handlers must
  /// not destroy the camera.
  V4l2Camera(boost::asio::io_context& io, V4l2System& system,
             std::chrono::milliseconds deadline = std::chrono::seconds(5));
  V4l2Camera(const V4l2Camera&) = delete;
  V4l2Camera& operator=(const V4l2Camera&) = delete;
  ~V4l2Camera();

  /// Opens the device and lets frames flow: about 640 x 480, in the first RawFormat that it offers. Waits for the
  /// driver, which may take a moment.
  /// Returns  a sentence that says why it is not possible; empty where it is.
  [[nodiscard]] std::string start(const std::string& path, Handlers handlers);
  /// Switches it off and gives everything back; no handler is called any more.
  void stop();
  bool is_on() const { return run_ != nullptr; }
  const RawLayout& layout() const { return layout_; }

 private:
  struct Buffer {
    void* data = nullptr;
    std::size_t length = 0;
  };

  std::string open();
  std::string choose_layout();
  std::string map_buffers();
  std::string stream();
  int queue(std::uint32_t index);
  void wait_for_frame();
  void take_frames();
  void take_frame(std::uint32_t index, std::uint32_t flags, std::uint32_t bytes);
  void watch();
  void lose(const std::string& why);
  void lose(const char* request, int error);

  V4l2System& system_;
  std::chrono::milliseconds deadline_;
  boost::asio::posix::stream_descriptor readable_;  ///< of descriptor_, which system_ closes
  boost::asio::steady_timer watch_;
  std::shared_ptr<const Handlers> run_;  ///< of this start(); pending waits of an earlier one find theirs gone
  std::string path_;
  int descriptor_ = -1;
  RawLayout layout_;
  std::vector<Buffer> buffers_;
  std::chrono::steady_clock::time_point last_frame_;
  int empty_wakes_ = 0;    ///< in a row
  std::string bad_frame_;  ///< what was wrong with the last one that was left out
};

}  // namespace rrgate::demo
