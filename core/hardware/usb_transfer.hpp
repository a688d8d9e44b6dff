// What a USB host is asked to carry out, and what came of it. Layer: hardware. Source: hardware spec section 3.1.
#pragma once

#include <chrono>
#include <cstdint>
#include <string>

#include "core/support/bytes.hpp"
#include "core/support/error.hpp"

namespace rr {

/// bmRequestType of vendor requests to an interface, from the device and to it. Source: USB 2.0 section 9.3.
inline constexpr std::uint8_t vendor_interface_in = 0xC1;
inline constexpr std::uint8_t vendor_interface_out = 0x41;

/// How a transfer ended.
enum class UsbStatus : std::uint8_t { ok, stall, no_device, timed_out, cancelled, overflow, busy, denied, failed };

constexpr const char* usb_status_text(UsbStatus status) {
  switch (status) {
    case UsbStatus::ok:
      return "done";
    case UsbStatus::stall:
      return "refused by the device (stall)";
    case UsbStatus::no_device:
      return "the device is gone";
    case UsbStatus::timed_out:
      return "no answer in time";
    case UsbStatus::cancelled:
      return "cancelled";
    case UsbStatus::overflow:
      return "the device sent more than was asked for";
    case UsbStatus::busy:
      return "another program or driver uses the interface";
    case UsbStatus::denied:
      return "permission denied";
    case UsbStatus::failed:
      break;
  }
  return "transfer error";
}

/// One control request on endpoint 0.
struct UsbControl {
  std::uint8_t request_type = 0;  ///< bmRequestType; its highest bit means device to host
  std::uint8_t request = 0;
  std::uint16_t value = 0;
  std::uint16_t index = 0;
  std::uint16_t length = 0;  ///< bytes asked for, or data.size()
  Bytes data = {};           ///< host to device only

  bool is_in() const { return (request_type & 0x80) != 0; }
  bool operator==(const UsbControl&) const = default;
};

/// How long a control request may take.
inline constexpr std::chrono::milliseconds usb_control_timeout{5000};

}  // namespace rr
