// Devices that have a kernel driver of their own: one open character device is one stream. Layer: node/transport.
// Source: hardware spec section 4.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "node/transport/byte_stream.hpp"

namespace rr {

/// Where the system shows its devices. Tests have places of their own.
struct DriverRoots {
  std::string classes = "/sys/class/robotraconteur";
  std::string devices = "/dev";
};

struct DriverDevice {
  std::string name;       ///< below both roots
  std::string transport;  ///< "usb", "pci", "bluetooth"
  NodeId id;              ///< any when the driver does not say, or says nonsense
  std::string node_name;  ///< likewise empty
};

/// Every device of which the transport and at least one of id and name are known, by name. A folder that does not
/// exist has none.
std::vector<DriverDevice> find_driver_devices(const DriverRoots& roots = {});

/// Opens the character device.
/// Errors   connection_error, or system_resource_permission_denied with what to do about it.
Result<std::unique_ptr<ByteStream>> open_driver_device(const boost::asio::any_io_executor& executor,
                                                       const DriverDevice& device, const DriverRoots& roots,
                                                       std::chrono::milliseconds send_stall);

}  // namespace rr
