#include "core/hardware/usb_sub_packet.hpp"

#include <catch2/catch.hpp>

#include "test/support/golden.hpp"
#include "test/support/print.hpp"

using namespace rr;
using namespace rr::test;

namespace {

std::string refusal(std::string_view hex) {
  const auto transfer = from_hex(hex);
  const auto parsed = parse_usb_sub_packet(transfer);
  return parsed ? "accepted" : parsed.error().message;
}

}  // namespace

TEST_CASE("a data sub-packet carries stream and payload") {
  const auto transfer = from_hex("0b00 0000 07000000 010203");
  const auto packet = parse_usb_sub_packet(transfer);
  REQUIRE(packet);
  CHECK_FALSE(packet->is_notice);
  CHECK(packet->stream == 7);
  CHECK(to_hex(packet->payload) == "010203");

  Bytes written(11, 9);
  write_usb_sub_packet_header(written, 7, 3);
  CHECK(to_hex(written) == "0b00000007000000090909");
}

TEST_CASE("a notification carries a code, which may be one of the future") {
  for (const int code : {0, 1, 2, 3, 77}) {
    auto transfer = from_hex("0a00 0200 ffffffff 0000");
    transfer[8] = static_cast<std::uint8_t>(code);
    const auto packet = parse_usb_sub_packet(transfer);
    REQUIRE(packet);
    CHECK(packet->is_notice);
    CHECK(packet->stream == -1);
    CHECK(static_cast<int>(packet->notice) == code);
  }
}

TEST_CASE("a sub-packet with a wrong length, a command or unknown flags is refused") {
  CHECK(refusal("0800 0000 07000000") == "accepted");
  CHECK(refusal("0900 0000 07000000") == "USB sub-packet: len is 9, the transfer has 8 bytes");
  CHECK(refusal("0800 0000 07000000 00") == "USB sub-packet: len is 8, the transfer has 9 bytes");
  CHECK(refusal("0700 0000 070000") == "USB sub-packet: found 7 bytes, expected 8 or more");
  CHECK(refusal("01") == "USB sub-packet: found 1 bytes, expected 8 or more");
  CHECK(refusal("0a00 0100 07000000 0000") == "USB sub-packet: a command, which no device may send");
  CHECK(refusal("0a00 0700 07000000 0000") == "USB sub-packet: flags 0x0007, expected 0 or 2");
  CHECK(refusal("0a00 0300 07000000 0000") == "USB sub-packet: flags 0x0003, expected 0 or 2");
  CHECK(refusal("0900 0200 07000000 01") == "USB notification: found 1 bytes, expected 2");
}
