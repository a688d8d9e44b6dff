// The claim on one USB device, which all its streams share, and one such stream. Layer: node/transport.
// Source: hardware spec section 3. The protocol itself is core/hardware/usb_link.hpp.
#pragma once

#include <boost/asio/steady_timer.hpp>
#include <map>
#include <memory>

#include "core/hardware/usb_link.hpp"
#include "node/transport/byte_stream.hpp"
#include "node/transport/usb_context.hpp"
#include "node/transport/watchdog.hpp"

namespace rr {

/// Opens and claims the device at once, and gives it back when the last stream has been closed.
class UsbClaim : public std::enable_shared_from_this<UsbClaim> {
 public:
  static std::shared_ptr<UsbClaim> start(UsbDevice device, UsbFunction function, UsbPipes pipes);
  UsbClaim(const UsbClaim&) = delete;
  UsbClaim& operator=(const UsbClaim&) = delete;

  /// Errors   connection_error: the device cannot be claimed, refuses the stream, or is silent until `deadline`.
  awaitable<Result<std::unique_ptr<ByteStream>>> open_stream(TimePoint deadline, std::chrono::milliseconds send_stall);

  /// New streams need a new claim, which has to wait until this one is_released().
  bool is_ending() const { return link_.state() >= UsbLinkState::closing; }
  bool is_released() const { return is_released_; }
  const boost::asio::any_io_executor& executor() const { return device_.context->executor(); }

 private:
  friend class UsbStream;
  class Waiting;

  UsbClaim(UsbDevice device, UsbFunction function, UsbPipes pipes)
      : device_(std::move(device)),
        function_(function),
        pipes_(pipes),
        link_(pipes, function.interface),
        read_stall_(executor(), [this] { handle_read_stall(); }) {}

  awaitable<void> claim();
  /// Carries out what the link asks for; after everything that the link was told or asked.
  void pump();
  void pump_transfers();
  void handle_read_stall();
  void release();

  UsbDevice device_;
  UsbFunction function_;
  UsbPipes pipes_;
  UsbLink link_;
  Deadline read_stall_;
  std::shared_ptr<UsbHandle> handle_;  ///< once claimed, until released
  std::map<UsbStreamKey, Waiting*> waiting_;
  bool is_pumping_ = false;
  bool is_released_ = false;
};

}  // namespace rr
