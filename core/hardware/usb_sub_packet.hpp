// The frame around every bulk transfer. Layer: hardware. Source: hardware spec section 3.3.
#pragma once

#include <cstdint>
#include <span>

#include "core/support/bytes.hpp"
#include "core/support/error.hpp"

namespace rr {

inline constexpr std::size_t usb_sub_packet_header = 8;

enum class UsbNotice : std::uint16_t { none = 0, socket_closed = 1, pause_request = 2, resume_request = 3 };

/// One transfer from the device: data of a stream, or a notice about it.
struct UsbSubPacket {
  std::int32_t stream = 0;
  bool is_notice = false;
  UsbNotice notice = UsbNotice::none;  ///< values without a name are to be ignored
  ByteSpan payload;                    ///< data; borrowed from the transfer
};

/// `transfer`  one whole bulk transfer, not empty.
/// Errors   protocol_error: `len` is not the transfer's length, a command, flags that nobody defined, half a notice.
///          Each is fatal for the device.
Result<UsbSubPacket> parse_usb_sub_packet(ByteSpan transfer);

/// Writes the header of a data sub-packet with `payload_size` bytes behind it. `into` holds at least 8 bytes.
void write_usb_sub_packet_header(std::span<std::uint8_t> into, std::int32_t stream, std::size_t payload_size);

}  // namespace rr
