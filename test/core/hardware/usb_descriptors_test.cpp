#include "core/hardware/usb_descriptors.hpp"

#include <catch2/catch.hpp>

#include "test/core/hardware/simulated_device.hpp"
#include "test/support/golden.hpp"
#include "test/support/print.hpp"

using namespace rr;
using namespace rr::test;

namespace {

/// The block of the spec, section 2.5: accepted by 1.2.8 as it stands.
const Bytes smallest_block = from_hex("0800 0000 0001 1600 0e00 0100 0000 0001 04 05 0100 0101");

template <class T>
std::string refusal(const Result<T>& result) {
  return result ? "accepted" : result.error().message;
}

Bytes changed(Bytes bytes, std::size_t at, std::uint8_t value) {
  bytes.at(at) = value;
  return bytes;
}

}  // namespace

TEST_CASE("a BOS tells interface and vendor code, wherever the capability stands") {
  const auto found = parse_usb_bos(usb_bos(3, 0xB0));
  REQUIRE(found);
  CHECK(*found == UsbFunction{3, 0xB0});
  const auto alone =
      parse_usb_bos(from_hex("05 0f 1d00 01  18 10 05 00 c30e6784 c6ce 1749 b039 510e3e71788b 0001 00 ba"));
  REQUIRE(alone);
  CHECK(*alone == UsbFunction{0, 0xBA});
  const auto none = parse_usb_bos(from_hex("05 0f 0c00 01  07 10 02 00000000"));
  REQUIRE_FALSE(none);
  CHECK(none.error().code == ErrorCode::node_not_found);
}

TEST_CASE("a BOS cut anywhere or with broken lengths is refused, never read beyond") {
  const auto whole = usb_bos(0, 0xBA);
  for (std::size_t size = 0; size < whole.size(); ++size) {
    INFO(size);
    CHECK_FALSE(parse_usb_bos(Bytes(whole.begin(), whole.begin() + static_cast<std::ptrdiff_t>(size))));
  }
  CHECK(refusal(parse_usb_bos(changed(whole, 5, 0))) ==
        "USB BOS capability bLength: found 0, expected 3 to the 31 bytes left");
  CHECK(refusal(parse_usb_bos(changed(whole, 5, 40))) ==
        "USB BOS capability bLength: found 40, expected 3 to the 31 bytes left");
  CHECK(refusal(parse_usb_bos(changed(whole, 33, 2))) ==
        "USB Robot Raconteur capability version: found 0x0200, expected 0x0100");
  CHECK(refusal(parse_usb_bos(changed(whole, 1, 2))) == "USB BOS descriptor type: found 2, expected 15");
  // One byte longer than the capability may be.
  auto longer = changed(changed(whole, 12, 25), 2, 37);
  longer.push_back(0);
  CHECK(refusal(parse_usb_bos(longer)) == "USB Robot Raconteur capability bLength: found 25, expected 24");
}

TEST_CASE("pipes are the first bulk endpoints of alternate 0 of the function's interface") {
  const std::vector<UsbInterface> interfaces = {
      {0, 0, 0x03, {{0x83, false, 8}}},
      {1, 1, 0xFF, {{0x84, true, 1024}, {0x04, true, 1024}}},
      {1, 0, 0xFF, {{0x85, false, 64}, {0x81, true, 512}, {0x82, true, 64}, {0x02, true, 256}, {0x03, true, 64}}},
      {2, 0, 0xFF, {{0x81, true, 8}, {0x02, true, 64}}},
      {3, 0, 0xFF, {{0x81, true, 64}}},
  };
  const auto pipes = find_usb_pipes(interfaces, 1);
  REQUIRE(pipes);
  CHECK(pipes->in.address == 0x81);
  CHECK(pipes->in.max_packet_size == 512);
  CHECK(pipes->out.address == 0x02);
  CHECK(pipes->out.max_packet_size == 256);
  CHECK(refusal(find_usb_pipes(interfaces, 0)) == "USB interface 0 class: found 3, expected 255");
  CHECK(refusal(find_usb_pipes(interfaces, 2)) == "USB interface 2 bulk IN packet size: found 8, expected 9 or more");
  CHECK(refusal(find_usb_pipes(interfaces, 3)) == "USB interface 3 bulk OUT packet size: found 0, expected 9 or more");
  CHECK(refusal(find_usb_pipes(interfaces, 4)) == "USB interface 4: the device has none of that number");
}

TEST_CASE("the descriptor block names the strings") {
  REQUIRE(parse_usb_block_header(smallest_block).value() == 22);
  CHECK(parse_usb_block(smallest_block).value() == UsbNodeStrings{4, 5});
  // An unknown sub-descriptor before it, a second protocol within it.
  CHECK(parse_usb_block(from_hex("0800 0000 0001 2000  0800 0900 0000 aabb  1000 0100 0000 0001 06 07 0200 0202 0101"))
            .value() == UsbNodeStrings{6, 7});
}

TEST_CASE("a descriptor block that breaks a rule is refused") {
  CHECK(refusal(parse_usb_block(changed(smallest_block, 0, 9))) == "USB descriptor block wLength: found 9, expected 8");
  CHECK(refusal(parse_usb_block(changed(smallest_block, 2, 1))) == "USB descriptor block type: found 1, expected 0");
  CHECK(refusal(parse_usb_block(changed(smallest_block, 5, 2))) ==
        "USB descriptor block version: found 0x0200, expected 0x0100");
  CHECK(refusal(parse_usb_block(changed(smallest_block, 8, 0))) ==
        "USB sub-descriptor wLength: found 0, expected 6 to the 14 bytes left");
  CHECK(refusal(parse_usb_block(changed(smallest_block, 8, 15))) ==
        "USB sub-descriptor wLength: found 15, expected 6 to the 14 bytes left");
  CHECK(refusal(parse_usb_block(changed(smallest_block, 10, 2))) ==
        "USB descriptor block: holds no interface descriptor");
  CHECK(refusal(parse_usb_block(changed(smallest_block, 15, 2))) ==
        "USB interface descriptor version: found 0x0200, expected 0x0100");
  CHECK(refusal(parse_usb_block(changed(smallest_block, 18, 2))) ==
        "USB interface descriptor wLength: found 14, expected 12 + 2 * 2");
  CHECK(refusal(parse_usb_block(changed(smallest_block, 20, 2))) ==
        "USB interface descriptor: none of its 1 protocols is 0x0101, which is the one we speak");
  for (std::size_t size = 0; size < smallest_block.size(); ++size)
    CHECK_FALSE(parse_usb_block(ByteSpan(smallest_block).first(size)));
}

TEST_CASE("a descriptor block longer than 8192 bytes is refused by its header") {
  CHECK(parse_usb_block_header(from_hex("0800 0000 0001 0020")).value() == 8192);
  CHECK(refusal(parse_usb_block_header(from_hex("0800 0000 0001 0120"))) ==
        "USB descriptor block wTotalLength: found 8193, expected 8 to 8192");
  CHECK(refusal(parse_usb_block_header(from_hex("0800 0000 0001 0700"))) ==
        "USB descriptor block wTotalLength: found 7, expected 8 to 8192");
}

TEST_CASE("strings are UTF-16 with a length that is true") {
  CHECK(parse_usb_languages(from_hex("0403 0904")).value() == 0x0409);
  CHECK(parse_usb_languages(from_hex("0603 0704 0904")).value() == 0x0407);
  CHECK_FALSE(parse_usb_languages(from_hex("0203")));
  CHECK(parse_usb_string(usb_string("node.name")).value() == "node.name");
  CHECK(parse_usb_string(from_hex("0203")).value().empty());
  CHECK(parse_usb_string(from_hex("0a03 e400 ac20 3dd8 00de")).value() == "\xc3\xa4\xe2\x82\xac\xf0\x9f\x98\x80");
  CHECK(refusal(parse_usb_string(from_hex("0403 3dd8"))) == "USB string descriptor: half a UTF-16 pair at byte 2");
  CHECK_FALSE(parse_usb_string(from_hex("0603 3dd8 4100")));
  CHECK_FALSE(parse_usb_string(from_hex("0403 00de")));
  CHECK(refusal(parse_usb_string(from_hex("0803 4100"))) ==
        "USB string descriptor bLength: found 8, expected the 4 bytes received, even");
  CHECK_FALSE(parse_usb_string(from_hex("0303 41")));
  CHECK_FALSE(parse_usb_string(from_hex("0402 4100")));
  CHECK_FALSE(parse_usb_string({}));
}
