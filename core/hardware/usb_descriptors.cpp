#include "core/hardware/usb_descriptors.hpp"

#include <algorithm>
#include <array>

#include "core/support/hex.hpp"
#include "core/support/utf8.hpp"

namespace rr {

namespace {

/// 84670ec3-cec6-4917-b039-510e3e71788b in the order of the wire.
constexpr std::array<std::uint8_t, 16> capability_uuid{0xc3, 0x0e, 0x67, 0x84, 0xc6, 0xce, 0x17, 0x49,
                                                       0xb0, 0x39, 0x51, 0x0e, 0x3e, 0x71, 0x78, 0x8b};
constexpr std::uint8_t bos_type = 0x0F;
constexpr std::uint8_t capability_type = 0x10;
constexpr std::uint8_t platform_capability = 0x05;
constexpr std::uint8_t string_type = 3;
constexpr std::size_t capability_header_size = 3;
constexpr std::size_t platform_header_size = 20;  ///< with the UUID
constexpr std::size_t our_capability_size = 24;
constexpr std::uint16_t our_version = 0x0100;
constexpr std::uint16_t interface_descriptor = 1;
constexpr std::size_t sub_header_size = 6;
constexpr std::size_t interface_descriptor_size = 12;  ///< without protocols
constexpr std::uint16_t smallest_packet = 9;           ///< eight bytes of header and one of payload

Error bad(const std::string& what, std::size_t found, const std::string& expected) {
  return protocol_error("USB " + what + ": found " + std::to_string(found) + ", expected " + expected);
}

Error bad_code(const std::string& what, std::uint32_t found, std::uint32_t expected) {
  return protocol_error("USB " + what + ": found 0x" + hex_text(found, 4) + ", expected 0x" + hex_text(expected, 4));
}

std::uint16_t load16(ByteSpan bytes, std::size_t at) {
  return load<std::uint16_t>(bytes.data() + at);
}

/// A string descriptor's own length is the number of bytes that came.
Result<> check_string(ByteSpan bytes, std::size_t smallest) {
  if (bytes.size() < smallest)
    return bad("string descriptor length", bytes.size(), std::to_string(smallest) + " or more");
  if (bytes[0] != bytes.size() || bytes[0] % 2 != 0)
    return bad("string descriptor bLength", bytes[0], "the " + std::to_string(bytes.size()) + " bytes received, even");
  if (bytes[1] != string_type) return bad("string descriptor type", bytes[1], "3");
  return {};
}

}  // namespace

Result<std::uint16_t> parse_usb_bos_header(ByteSpan bytes) {
  if (bytes.size() < usb_bos_header_size) return bad("BOS length", bytes.size(), "5 or more");
  if (bytes[0] < usb_bos_header_size) return bad("BOS bLength", bytes[0], "5");
  if (bytes[1] != bos_type) return bad("BOS descriptor type", bytes[1], "15");
  const auto total = load16(bytes, 2);
  if (total < bytes[0]) return bad("BOS wTotalLength", total, std::to_string(bytes[0]) + " or more");
  return total;
}

Result<UsbFunction> parse_usb_bos(ByteSpan bytes) {
  const auto total = parse_usb_bos_header(bytes);
  if (!total) return total.error();
  if (bytes.size() < *total) return bad("BOS length", bytes.size(), std::to_string(*total));
  for (auto rest = bytes.first(*total).subspan(bytes[0]); !rest.empty(); rest = rest.subspan(rest[0])) {
    if (rest.size() < capability_header_size || rest[0] < capability_header_size || rest[0] > rest.size())
      return bad("BOS capability bLength", rest[0], "3 to the " + std::to_string(rest.size()) + " bytes left");
    if (rest[1] != capability_type || rest[2] != platform_capability || rest[0] < platform_header_size) continue;
    if (!std::equal(capability_uuid.begin(), capability_uuid.end(), rest.begin() + 4)) continue;
    if (rest[0] != our_capability_size) return bad("Robot Raconteur capability bLength", rest[0], "24");
    if (const auto version = load16(rest, 20); version != our_version)
      return bad_code("Robot Raconteur capability version", version, our_version);
    return UsbFunction{rest[22], rest[23]};
  }
  return make_error(ErrorCode::node_not_found, "USB BOS descriptor: no Robot Raconteur capability");
}

Result<UsbPipes> find_usb_pipes(std::span<const UsbInterface> interfaces, std::uint8_t number) {
  const auto found = std::find_if(interfaces.begin(), interfaces.end(), [number](const UsbInterface& candidate) {
    return candidate.number == number && candidate.alternate == 0;
  });
  const auto what = "interface " + std::to_string(number);
  if (found == interfaces.end()) return protocol_error("USB " + what + ": the device has none of that number");
  if (found->class_code != usb_vendor_class) return bad(what + " class", found->class_code, "255");
  const auto first_bulk = [&](bool is_in) {
    for (const auto& endpoint : found->endpoints)
      if (endpoint.is_bulk && ((endpoint.address & 0x80) != 0) == is_in) return endpoint;
    return UsbEndpoint{};
  };
  const UsbPipes pipes{first_bulk(true), first_bulk(false)};
  if (pipes.in.max_packet_size < smallest_packet)
    return bad(what + " bulk IN packet size", pipes.in.max_packet_size, "9 or more");
  if (pipes.out.max_packet_size < smallest_packet)
    return bad(what + " bulk OUT packet size", pipes.out.max_packet_size, "9 or more");
  return pipes;
}

Result<std::uint16_t> parse_usb_block_header(ByteSpan bytes) {
  if (bytes.size() < usb_block_header_size) return bad("descriptor block length", bytes.size(), "8 or more");
  if (const auto length = load16(bytes, 0); length != usb_block_header_size)
    return bad("descriptor block wLength", length, "8");
  if (const auto type = load16(bytes, 2); type != 0) return bad("descriptor block type", type, "0");
  if (const auto version = load16(bytes, 4); version != our_version)
    return bad_code("descriptor block version", version, our_version);
  const auto total = load16(bytes, 6);
  if (total < usb_block_header_size || total > max_usb_block_size)
    return bad("descriptor block wTotalLength", total, "8 to " + std::to_string(max_usb_block_size));
  return total;
}

Result<UsbNodeStrings> parse_usb_block(ByteSpan bytes) {
  const auto total = parse_usb_block_header(bytes);
  if (!total) return total.error();
  if (bytes.size() != *total) return bad("descriptor block length", bytes.size(), std::to_string(*total));
  for (auto rest = bytes.subspan(usb_block_header_size); !rest.empty();) {
    const std::size_t length = rest.size() < 2 ? 0 : load16(rest, 0);
    if (length < sub_header_size || length > rest.size())
      return bad("sub-descriptor wLength", length, "6 to the " + std::to_string(rest.size()) + " bytes left");
    const auto sub = rest.first(length);
    rest = rest.subspan(length);
    if (load16(sub, 2) != interface_descriptor || load16(sub, 4) != 0) continue;
    if (length < interface_descriptor_size) return bad("interface descriptor wLength", length, "12 or more");
    if (const auto version = load16(sub, 6); version != our_version)
      return bad_code("interface descriptor version", version, our_version);
    const std::size_t protocols = load16(sub, 10);
    if (length != interface_descriptor_size + 2 * protocols)
      return bad("interface descriptor wLength", length, "12 + 2 * " + std::to_string(protocols));
    for (std::size_t at = interface_descriptor_size; at < length; at += 2)
      if (load16(sub, at) == usb_stream_protocol) return UsbNodeStrings{sub[8], sub[9]};
    return protocol_error("USB interface descriptor: none of its " + std::to_string(protocols) +
                          " protocols is 0x0101, which is the one we speak");
  }
  return protocol_error("USB descriptor block: holds no interface descriptor");
}

Result<std::uint16_t> parse_usb_languages(ByteSpan bytes) {
  if (auto checked = check_string(bytes, 4); !checked) return checked.error();
  return load16(bytes, 2);
}

Result<std::string> parse_usb_string(ByteSpan bytes) {
  if (auto checked = check_string(bytes, 2); !checked) return checked.error();
  std::string out;
  for (std::size_t at = 2; at < bytes.size(); at += 2) {
    std::uint32_t code = load16(bytes, at);
    if (code >= 0xD800 && code < 0xE000) {
      const std::uint32_t low = at + 2 < bytes.size() ? load16(bytes, at + 2) : 0u;
      if (code >= 0xDC00 || low < 0xDC00 || low >= 0xE000)
        return protocol_error("USB string descriptor: half a UTF-16 pair at byte " + std::to_string(at));
      code = 0x10000 + ((code - 0xD800) << 10) + (low - 0xDC00);
      at += 2;
    }
    append_utf8(out, code);
  }
  return out;
}

}  // namespace rr
