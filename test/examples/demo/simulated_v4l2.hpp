// Video devices that a test plugs in: what their drivers say, and the frames that they give. Test support.
#pragma once

#include <linux/videodev2.h>

#include <boost/asio/io_context.hpp>
#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "examples/demo/v4l2_system.hpp"

namespace rrgate::demo {

/// A frame as the driver hands it out; it need not be true.
struct SimulatedFrame {
  std::vector<std::uint8_t> bytes;
  std::optional<std::uint32_t> bytes_used = {};  ///< none: as many as there are
  std::optional<std::uint32_t> index = {};       ///< none: that of the buffer
  std::uint32_t flags = 0;
};

struct SimulatedDevice {
  std::string name = "Simulated Camera";
  std::string port = "usb-1";
  std::uint32_t capabilities = V4L2_CAP_VIDEO_CAPTURE | V4L2_CAP_STREAMING;
  std::vector<std::uint32_t> formats = {V4L2_PIX_FMT_MJPEG, V4L2_PIX_FMT_YUYV};
  std::uint32_t width = 4, height = 2, step = 8, frame_bytes = 16;  ///< what it makes of any wish
  std::optional<std::uint32_t> format = {};                         ///< none: the one that it is asked for
  std::uint32_t buffers = 4;                                        ///< that it gives at most
  std::optional<std::uint32_t> buffer_bytes = {};                   ///< none: frame_bytes
  std::map<unsigned long, int> errors = {};                         ///< by request, of all times
  int open_error = 0;
  std::deque<SimulatedFrame> frames = {};
  std::optional<SimulatedFrame> always = {};  ///< once there are no other frames

  // What the camera's user does with it.
  std::uint32_t asked_format = 0;
  bool is_streaming = false;
  int times_opened = 0;
};

class SimulatedV4l2 : public V4l2System {
 public:
  ~SimulatedV4l2() override;

  SimulatedDevice& plug_in(const std::string& path, SimulatedDevice device = {});
  /// Who has it open gets ENODEV from now on.
  void unplug(const std::string& path);
  void give(const std::string& path, SimulatedFrame frame);
  /// The descriptor wakes its waiter though there may be no frame.
  void wake(const std::string& path);
  SimulatedDevice& at(const std::string& path) { return devices_.at(path); }
  bool is_all_given_back() const { return opened_.empty() && mapped_.empty(); }

  std::vector<std::string> list() override;
  int open(const std::string& path) override;
  void close(int descriptor) override;
  int control(int descriptor, unsigned long request, void* argument) override;
  void* map(int descriptor, std::size_t length, std::int64_t offset) override;
  void unmap(void* data, std::size_t length) override;

  bool refuses_to_map = false;

 private:
  struct Opened {
    std::string path;
    bool is_gone = false;
    std::deque<std::uint32_t> queued = {};
    std::map<std::uint32_t, std::uint8_t*> buffers = {};
  };

  int dequeue(Opened& opened, int descriptor, v4l2_buffer& buffer);

  std::map<std::string, SimulatedDevice> devices_;
  std::map<int, Opened> opened_;
  std::map<void*, std::size_t> mapped_;
};

/// Runs `io` until `is_done()`, ten seconds at most. Returns what it says then.
bool run_until(boost::asio::io_context& io, const std::function<bool()>& is_done);

}  // namespace rrgate::demo
