// libusb on the thread of an executor: contexts, devices, opened devices, transfers. Layer: node/transport.
//
// libusb's descriptors are watched by Asio, and its events handled when they are ready; so nothing here has a thread
// (libusb keeps one of its own for hot-plug, which never calls us), and completions run on the executor's thread.
#pragma once

#include <boost/asio/any_io_executor.hpp>
#include <boost/asio/posix/stream_descriptor.hpp>
#include <chrono>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "core/hardware/usb_descriptors.hpp"
#include "core/hardware/usb_transfer.hpp"

struct libusb_context;
struct libusb_device;
struct libusb_device_handle;

namespace rr {

/// A device that another program is only just looking at is tried again.
inline constexpr std::chrono::milliseconds usb_busy_pause{100};
inline constexpr int usb_busy_attempts = 20;

class UsbContext;

/// A device as enumeration found it; nothing is opened. Cheap to copy; keeps its context alive.
struct UsbDevice {
  std::shared_ptr<UsbContext> context;
  std::shared_ptr<libusb_device> device;

  std::string key;   ///< "<bus>,<address>": another one each time that the device is plugged in
  std::string path;  ///< "1-2.3", as in sysfs
  std::string node;  ///< "/dev/bus/usb/001/004"
  std::uint16_t vendor_id = 0;
  std::uint16_t product_id = 0;
  std::uint16_t usb_version = 0;  ///< bcdUSB
  std::uint8_t class_code = 0;
  std::uint8_t configuration = 0;  ///< value of the first one
  std::vector<UsbInterface> interfaces;

  /// "USB device 1-2.3 (1209:5252)" for messages.
  std::string description() const;
};

class UsbContext : public std::enable_shared_from_this<UsbContext> {
 public:
  /// Errors   system_resource_error: libusb cannot be initialised.
  static Result<std::shared_ptr<UsbContext>> make(const boost::asio::any_io_executor& executor);
  ~UsbContext();
  UsbContext(const UsbContext&) = delete;
  UsbContext& operator=(const UsbContext&) = delete;

  /// What is plugged in. A context that was made a while ago knows of later devices only where udev runs, so take a
  /// new one for each look.
  std::vector<UsbDevice> devices();

  /// Before the execution context goes: transfers are cancelled and waited for, and descriptors let go.
  void shut_down();

  const boost::asio::any_io_executor& executor() const { return executor_; }

 private:
  friend class UsbHandle;
  struct Watched;

  explicit UsbContext(const boost::asio::any_io_executor& executor) : executor_(executor) {}
  void watch(int descriptor, short events);
  void unwatch(int descriptor);
  void wait();
  void stop_waiting();
  void handle_events();

  boost::asio::any_io_executor executor_;
  libusb_context* context_ = nullptr;
  std::map<int, std::shared_ptr<Watched>> watched_;
  std::size_t pending_transfers_ = 0;
  std::vector<std::weak_ptr<class UsbHandle>> handles_;
};

/// An opened device; closed by its destructor. A pending transfer keeps it.
class UsbHandle : public std::enable_shared_from_this<UsbHandle> {
 public:
  struct Opened {
    UsbStatus status = UsbStatus::failed;
    std::shared_ptr<UsbHandle> handle;
  };
  static Opened open(const UsbDevice& device);
  ~UsbHandle();
  UsbHandle(const UsbHandle&) = delete;
  UsbHandle& operator=(const UsbHandle&) = delete;

  /// Selects the configuration if another one is active, then claims the interface, until release() or the destructor.
  UsbStatus claim(std::uint8_t configuration, std::uint8_t interface);
  void release();

  /// Each calls `done` exactly once, never before it returns.
  void control(const UsbControl& request, std::function<void(UsbStatus, ByteSpan)> done);
  /// `buffer` has to stay where it is; what `done` holds stays until then. Without a timeout.
  void bulk(std::uint8_t endpoint, std::span<std::uint8_t> buffer, std::function<void(UsbStatus, std::size_t)> done);
  /// All pending transfers end with UsbStatus::cancelled.
  void cancel();

 private:
  friend class UsbContext;
  struct Transfer;

  UsbHandle(std::shared_ptr<UsbContext> context, libusb_device_handle* handle)
      : context_(std::move(context)), handle_(handle) {}
  void submit(std::unique_ptr<Transfer> transfer);

  std::shared_ptr<UsbContext> context_;
  libusb_device_handle* handle_;
  int claimed_interface_ = -1;
  std::vector<Transfer*> pending_;
};

}  // namespace rr
