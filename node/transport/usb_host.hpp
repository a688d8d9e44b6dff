// The Robot Raconteur devices on this computer's USB. Layer: node/transport. Source: hardware spec sections
// 2, 3.2, 3.4.
#pragma once

#include <boost/asio/execution_context.hpp>
#include <boost/asio/steady_timer.hpp>
#include <functional>
#include <map>
#include <optional>

#include "core/hardware/usb_probe.hpp"
#include "node/transport/dial.hpp"
#include "node/transport/usb_context.hpp"

namespace rr {

class UsbClaim;

/// One for each execution context, which runs on one thread. A device that one context uses is busy for all others, in
/// this process and elsewhere.
class UsbHost final : public boost::asio::execution_context::service {
 public:
  static boost::asio::execution_context::id id;
  static UsbHost& of(const boost::asio::any_io_executor& executor);
  explicit UsbHost(boost::asio::execution_context& context) : service(context) {}

  struct Node {
    NodeId id;
    std::string name;    ///< may be empty
    std::string device;  ///< "USB device 1-2 (1209:5252)"
  };
  struct Found {
    std::vector<Node> nodes;
    /// Devices that may be nodes but can't be used, and why: a missing permission, or what is wrong with their answers.
    std::vector<std::string> problems;
  };
  /// Looks at what is plugged in; devices are asked who they are when they are new, or could not be asked before.
  awaitable<Found> scan();

  /// Opens a stream to the device that `matches`, and to the first of several.
  /// Errors   connection_error: none, or none that can be reached in time; names what was found instead.
  awaitable<Result<std::unique_ptr<ByteStream>>> dial(std::function<bool(const Node&)> matches, DialOptions options);

 private:
  struct Known {
    UsbDevice device;
    UsbPipes pipes;
    std::optional<Result<UsbNodeInfo>> probed;  ///< none: not asked yet, or worth asking again
    std::string problem;                        ///< why the device can't be used; empty: it can, or is not one of ours
    bool is_present = false;
    std::weak_ptr<UsbClaim> claim;

    /// It has said what it is.
    void settle(Result<UsbNodeInfo> answer);
  };

  void shutdown() override;
  Result<> look();
  static awaitable<void> probe(std::shared_ptr<Known> known);
  /// A known device that was asked; null: there is none.
  std::shared_ptr<Known> find(const std::function<bool(const Node&)>& matches) const;

  std::optional<boost::asio::any_io_executor> executor_;
  std::map<std::string, std::shared_ptr<Known>> known_;  ///< by UsbDevice::key
  std::vector<std::weak_ptr<UsbContext>> contexts_;
  std::string problem_;  ///< libusb itself does not work
  bool is_scanning_ = false;
  bool was_cut_short_ = false;                        ///< the last scan was cancelled
  std::optional<boost::asio::steady_timer> scanned_;  ///< cancelled at the end of a scan
};

}  // namespace rr
