// Devices that are nodes, reached through the host's hardware: rr+usb and rr+pci. Layer: node/transport.
// Source: hardware spec.
#pragma once

#include <boost/asio/steady_timer.hpp>
#include <functional>
#include <string>
#include <vector>

#include "node/transport/dial.hpp"
#include "node/transport/driver_device.hpp"

namespace rr {

struct HardwareNode {
  std::string scheme;  ///< "rr+usb", "rr+pci"
  NodeId id;           ///< any where only the name is known
  std::string name;    ///< may be empty
  std::string url;     ///< of the node's service index
  bool operator==(const HardwareNode&) const = default;
};

/// What is plugged in now.
struct HardwareNodes {
  std::vector<HardwareNode> nodes;
  std::vector<std::string> problems;  ///< USB devices that may be nodes but can't be used, and why
};

// Overloads, since g++ 12 destroys a braced default argument of an awaited call twice.

/// Order of look-up: devices with a kernel driver, then those that libusb finds (rr+usb only).
/// Errors   connection_error: no device matches, or it can't be reached in time.
awaitable<Result<std::unique_ptr<ByteStream>>> dial_hardware(ConnectionUrl url, DialOptions options, DriverRoots roots);
awaitable<Result<std::unique_ptr<ByteStream>>> dial_hardware(ConnectionUrl url, DialOptions options);

awaitable<HardwareNodes> list_hardware_nodes(DriverRoots roots);
awaitable<HardwareNodes> list_hardware_nodes();

/// Hands the list of nodes to `on_nodes`: at once, shortly after the kernel or udev says that something was plugged in
/// or out, and every `refresh`. `on_problem` hears of each problem that the look before had not. For the executor's
/// thread.
class HardwareWatch {
 public:
  using OnNodes = std::function<void(const std::vector<HardwareNode>&)>;
  using OnProblem = std::function<void(const std::string& problem)>;
  HardwareWatch(const boost::asio::any_io_executor& executor, OnNodes on_nodes, OnProblem on_problem,
                std::chrono::milliseconds refresh = std::chrono::seconds(30), DriverRoots roots = {});
  /// No call any more from here on.
  ~HardwareWatch();

 private:
  struct State;
  static awaitable<void> run(std::shared_ptr<State> state);
  static awaitable<void> listen(std::shared_ptr<State> state);
  std::shared_ptr<State> state_;
};

}  // namespace rr
