// Frames of a camera of this machine, which is on while somebody asks for them. Layer: demo.
#pragma once

#include <chrono>
#include <vector>

#include "examples/demo/v4l2_camera.hpp"

namespace rrgate::demo {

/// How a camera is found again that was unplugged.
enum class FoundBy {
  path,  ///< whatever camera has its path
  port,  ///< the camera of its name at its port
  name   ///< the camera of its name, at any port: there was no other of that name
};

/// The path where `camera` is now; empty where it is not among `present`.
std::string find_again(const CameraIdentity& camera, FoundBy by, const std::vector<CameraIdentity>& present);

class CameraSource : public FrameSource {
 public:
  struct Times {
    std::chrono::milliseconds deadline{5000};  ///< within which a frame comes, or the camera is lost
    std::chrono::milliseconds idle{3000};      ///< after which it is switched off when nobody asks
    std::chrono::milliseconds retry{1000};     ///< after a failure, requests get its sentence without another attempt
  };

  /// `io` and `system` outlive the source; take() is for the thread that runs `io`.
  CameraSource(boost::asio::io_context& io, V4l2System& system, CameraIdentity camera, FoundBy by)
      : CameraSource(io, system, std::move(camera), by, Times{}) {}
  CameraSource(boost::asio::io_context& io, V4l2System& system, CameraIdentity camera, FoundBy by, Times times);

  std::string name() const override { return camera_.name; }
  /// Switches the camera on where it is off. The frame is one that comes after the call.
  void take(Taken taken) override;
  bool is_on() const { return device_.is_on(); }

 private:
  using Clock = std::chrono::steady_clock;

  std::string switch_on();
  void on_frame(const RawFrame& frame);
  void on_lost(const std::string& why);
  void answer(const FrameResult& result);

  V4l2System& system_;
  CameraIdentity camera_;
  FoundBy by_;
  Times times_;
  std::vector<Taken> waiting_;
  Clock::time_point last_request_;
  Clock::time_point failed_;
  std::string failure_;  ///< empty: the last attempt went well
  int unreadable_ = 0;   ///< frames in a row that could not be decoded
  V4l2Camera device_;    ///< last: its handlers use the rest
};

}  // namespace rrgate::demo
