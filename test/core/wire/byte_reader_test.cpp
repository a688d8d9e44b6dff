#include "core/wire/byte_reader.hpp"

#include <catch2/catch.hpp>

#include "test/support/golden.hpp"

using namespace rr;
using rr::test::from_hex;

namespace {

std::uint32_t read_uint_x(const char* hex) {
  const auto bytes = from_hex(hex);
  ByteReader in(bytes);
  const auto value = in.uint_x("field");
  CHECK(in.ok());
  CHECK(in.left() == 0);
  return value;
}

std::int32_t read_int_x(const char* hex) {
  const auto bytes = from_hex(hex);
  ByteReader in(bytes);
  const auto value = in.int_x("field");
  CHECK(in.ok());
  CHECK(in.left() == 0);
  return value;
}

}  // namespace

TEST_CASE("uint_x is read in its shortest and in over-long forms") {
  CHECK(read_uint_x("00") == 0);
  CHECK(read_uint_x("fc") == 252);
  CHECK(read_uint_x("fdfd00") == 253);
  CHECK(read_uint_x("fdffff") == 65535);
  CHECK(read_uint_x("fe00000100") == 65536);
  CHECK(read_uint_x("feffffffff") == 4294967295u);
  CHECK(read_uint_x("fd0500") == 5);
  CHECK(read_uint_x("fe05000000") == 5);
}

TEST_CASE("int_x is read in its shortest and in over-long forms") {
  CHECK(read_int_x("7e00000080") == std::numeric_limits<std::int32_t>::min());
  CHECK(read_int_x("7eff7fffff") == -32769);
  CHECK(read_int_x("7d0080") == -32768);
  CHECK(read_int_x("7d7fff") == -129);
  CHECK(read_int_x("80") == -128);
  CHECK(read_int_x("ff") == -1);
  CHECK(read_int_x("00") == 0);
  CHECK(read_int_x("7c") == 124);
  CHECK(read_int_x("7d7d00") == 125);
  CHECK(read_int_x("7d8000") == 128);
  CHECK(read_int_x("7e00800000") == 32768);
  CHECK(read_int_x("7e05000000") == 5);
}

TEST_CASE("sizes of variable-length integers step where the format says") {
  CHECK(uint_x_size(252) == 1);
  CHECK(uint_x_size(253) == 3);
  CHECK(uint_x_size(65535) == 3);
  CHECK(uint_x_size(65536) == 5);
  CHECK(int_x_size(-128) == 1);
  CHECK(int_x_size(-129) == 3);
  CHECK(int_x_size(124) == 1);
  CHECK(int_x_size(125) == 3);
  CHECK(int_x_size(-32769) == 5);
  CHECK(int_x_size(32768) == 5);
  CHECK(with_uint_x_size(251) == 252);
  CHECK(with_uint_x_size(252) == 255);
  CHECK(with_uint_x_size(65532) == 65535);
  CHECK(with_uint_x_size(65533) == 65538);
}

TEST_CASE("first bytes FF of uint_x and 7F of int_x are refused") {
  const auto bytes = from_hex("ff 7f");
  ByteReader unsigned_in(bytes);
  unsigned_in.uint_x("DataCount");
  REQUIRE_FALSE(unsigned_in.ok());
  CHECK(unsigned_in.take_error().message == "DataCount at byte 0: a uint_x cannot start with FF");
  ByteReader signed_in(bytes);
  signed_in.bytes(1, "skipped");
  signed_in.int_x("ElementNumber");
  REQUIRE_FALSE(signed_in.ok());
  CHECK(signed_in.take_error().message == "ElementNumber at byte 1: an int_x cannot start with 7F");
}

TEST_CASE("the reader stops at its limit and keeps its first failure") {
  const auto bytes = from_hex("0102 0304 0506");
  ByteReader in(bytes);
  in.set_limit(4);
  CHECK(in.number<std::uint16_t>("first") == 0x0201);
  CHECK(in.number<std::uint32_t>("second") == 0);
  CHECK_FALSE(in.ok());
  in.set_limit(6);  // no way back
  CHECK(in.left() == 0);
  CHECK(in.number<std::uint8_t>("third") == 0);
  CHECK(in.text_x("fourth").empty());
  const auto error = in.take_error();
  CHECK(error.code == ErrorCode::protocol_error);
  CHECK(error.message == "second at byte 2: 4 bytes needed, 2 left before the end of its structure");
}

TEST_CASE("texts are views into the input") {
  const auto bytes = from_hex("0200 6162 03 636465");
  ByteReader in(bytes);
  const auto first = in.text16("first");
  const auto second = in.text_x("second");
  CHECK(first == "ab");
  CHECK(second == "cde");
  CHECK(reinterpret_cast<const std::uint8_t*>(second.data()) == bytes.data() + 5);
}
