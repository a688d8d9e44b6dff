// What a USB device says of itself: the platform capability, endpoints, the Robot Raconteur block, strings.
// Layer: hardware. Source: hardware spec sections 2.1 to 2.6. All of it is untrusted input.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "core/support/bytes.hpp"
#include "core/support/error.hpp"

namespace rr {

/// The Robot Raconteur function of a device. 1.2.8 always takes the defaults; we honour what the device says.
struct UsbFunction {
  std::uint8_t interface = 0;
  std::uint8_t vendor_code = 0xBA;
  bool operator==(const UsbFunction&) const = default;
};

inline constexpr std::size_t usb_bos_header_size = 5;
/// wTotalLength of a BOS, from its first five bytes. Errors   protocol_error.
Result<std::uint16_t> parse_usb_bos_header(ByteSpan bytes);
/// Looks for Robot Raconteur's platform capability.
/// Errors   node_not_found: the device has none; protocol_error: a broken BOS, or a capability of another length or
/// version.
Result<UsbFunction> parse_usb_bos(ByteSpan bytes);

struct UsbEndpoint {
  std::uint8_t address = 0;  ///< highest bit: IN
  bool is_bulk = false;
  std::uint16_t max_packet_size = 0;
};

/// One alternate setting of one interface of the first configuration.
struct UsbInterface {
  std::uint8_t number = 0;
  std::uint8_t alternate = 0;
  std::uint8_t class_code = 0;
  std::vector<UsbEndpoint> endpoints;
};

inline constexpr std::uint8_t usb_vendor_class = 0xFF;

/// The two bulk pipes that carry all streams. A sub-packet is as large as one packet.
struct UsbPipes {
  UsbEndpoint in;
  UsbEndpoint out;
};
/// First bulk IN and first bulk OUT of alternate 0 of interface `number`.
/// Errors   protocol_error: no such interface, not vendor specific, or an endpoint missing or too small.
Result<UsbPipes> find_usb_pipes(std::span<const UsbInterface> interfaces, std::uint8_t number);

inline constexpr std::size_t usb_block_header_size = 8;
/// A longer block is refused before it is asked for.
inline constexpr std::uint16_t max_usb_block_size = 8192;
inline constexpr std::uint16_t usb_stream_protocol = 0x0101;

/// wTotalLength of the Robot Raconteur descriptor block, from its first eight bytes. Errors   protocol_error.
Result<std::uint16_t> parse_usb_block_header(ByteSpan bytes);

/// Indexes of the string descriptors that name the node.
struct UsbNodeStrings {
  std::uint8_t node_id = 0;
  std::uint8_t node_name = 0;
  bool operator==(const UsbNodeStrings&) const = default;
};
/// Finds the interface descriptor in the whole block; unknown sub-descriptors are skipped.
/// Errors   protocol_error: lengths that don't fit, wrong version, no interface descriptor, no protocol 0x0101.
Result<UsbNodeStrings> parse_usb_block(ByteSpan bytes);

/// The first LANGID of string descriptor 0. Errors   protocol_error.
Result<std::uint16_t> parse_usb_languages(ByteSpan bytes);
/// The text of a string descriptor, in UTF-8; may be empty. Errors   protocol_error.
Result<std::string> parse_usb_string(ByteSpan bytes);

}  // namespace rr
