#include "core/hardware/usb_sub_packet.hpp"

#include "core/support/hex.hpp"

namespace rr {

namespace {

constexpr std::uint16_t data_flags = 0;
constexpr std::uint16_t command_flags = 1;
constexpr std::uint16_t notice_flags = 2;

}  // namespace

Result<UsbSubPacket> parse_usb_sub_packet(ByteSpan transfer) {
  if (transfer.size() < usb_sub_packet_header)
    return protocol_error("USB sub-packet: found " + std::to_string(transfer.size()) + " bytes, expected 8 or more");
  const auto length = load<std::uint16_t>(transfer.data());
  if (length != transfer.size())
    return protocol_error("USB sub-packet: len is " + std::to_string(length) + ", the transfer has " +
                          std::to_string(transfer.size()) + " bytes");
  const auto flags = load<std::uint16_t>(transfer.data() + 2);
  UsbSubPacket out;
  out.stream = load<std::int32_t>(transfer.data() + 4);
  out.payload = transfer.subspan(usb_sub_packet_header);
  if (flags == data_flags) return out;
  if (flags == command_flags) return protocol_error("USB sub-packet: a command, which no device may send");
  if (flags != notice_flags)
    return protocol_error("USB sub-packet: flags 0x" + hex_text(flags, 4) + ", expected 0 or 2");
  if (out.payload.size() < sizeof(std::uint16_t))
    return protocol_error("USB notification: found " + std::to_string(out.payload.size()) + " bytes, expected 2");
  out.is_notice = true;
  out.notice = static_cast<UsbNotice>(load<std::uint16_t>(out.payload.data()));
  out.payload = {};
  return out;
}

void write_usb_sub_packet_header(std::span<std::uint8_t> into, std::int32_t stream, std::size_t payload_size) {
  const auto length = static_cast<std::uint16_t>(usb_sub_packet_header + payload_size);
  std::memcpy(into.data(), &length, sizeof(length));
  std::memcpy(into.data() + 2, &data_flags, sizeof(data_flags));
  std::memcpy(into.data() + 4, &stream, sizeof(stream));
}

}  // namespace rr
