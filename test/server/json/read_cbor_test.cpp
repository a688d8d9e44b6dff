// CBOR as RFC 8949 shows it, and as nobody should send it.
#include <catch2/catch.hpp>

#include "server/json/json.hpp"
#include "test/support/golden.hpp"

using namespace rr;
using namespace rr::test;

namespace {

/// The document as JSON text (bytes as nlohmann shows them), or the error.
std::string shown(ByteSpan bytes) {
  const auto read = read_cbor(bytes);
  return read ? read->dump() : read.error().message;
}

std::string shown(const std::string& hex) {
  return shown(from_hex(hex));
}

std::string starting_with(std::string_view first, std::size_t count) {
  std::string hex;
  for (std::size_t i = 0; i < count; ++i) hex += first;
  return hex;
}

}  // namespace

TEST_CASE("cbor: the examples of the RFC") {
  CHECK(shown("00") == "0");
  CHECK(shown("1818") == "24");
  CHECK(shown("1903e8") == "1000");
  CHECK(shown("1bffffffffffffffff") == "18446744073709551615");
  CHECK(shown("20") == "-1");
  CHECK(shown("3903e7") == "-1000");
  CHECK(shown("3b7fffffffffffffff") == "-9223372036854775808");
  CHECK(shown("3bffffffffffffffff") == "-1.8446744073709552e+19");
  CHECK(shown("f93c00") == "1.0");
  CHECK(shown("f90001") == "5.960464477539063e-08");
  CHECK(shown("f9c400") == "-4.0");
  CHECK(read_cbor(from_hex("f9fc00"))->get<double>() == -std::numeric_limits<double>::infinity());
  CHECK(shown("fa47c35000") == "100000.0");
  CHECK(shown("fb3ff199999999999a") == "1.1");
  CHECK(shown("f4") == "false");
  CHECK(shown("f5") == "true");
  CHECK(shown("f6") == "null");
  CHECK(shown("6449455446") == "\"IETF\"");
  CHECK(shown("8301820203820405") == "[1,[2,3],[4,5]]");
  CHECK(shown("a26161016162820203") == R"({"a":1,"b":[2,3]})");
  CHECK(shown("9f018202039f0405ffff") == "[1,[2,3],[4,5]]");
  CHECK(shown("bf6346756ef563416d7421ff") == R"({"Amt":-2,"Fun":true})");
  CHECK(shown("7f657374726561646d696e67ff") == "\"streaming\"");
  CHECK(shown("5f42010243030405ff") == R"({"bytes":[1,2,3,4,5],"subtype":null})");
  CHECK(shown("d84041ff") == R"({"bytes":[255],"subtype":64})");
  CHECK(shown("80") == "[]");
  CHECK(shown("a0") == "{}");
}

TEST_CASE("cbor: what is malformed says where") {
  CHECK(shown("") == "CBOR is no CBOR at byte 0");
  CHECK(shown("8201") == "CBOR is no CBOR at byte 2");
  CHECK(shown("0000") == "CBOR is no CBOR at byte 1");
  CHECK(shown("1c") == "CBOR is no CBOR at byte 0");
  CHECK(shown("1f") == "CBOR is no CBOR at byte 0");
  CHECK(shown("ff") == "CBOR is no CBOR at byte 0");
  CHECK(shown("81ff") == "CBOR is no CBOR at byte 1");
  CHECK(shown("bf6161ff") == "CBOR is no CBOR at byte 3");
  CHECK(shown("6261") == "CBOR is no CBOR at byte 0");
  CHECK(shown("7bffffffffffffffff61") == "CBOR is no CBOR at byte 0");
  CHECK(shown("7f4161ff") == "CBOR is no CBOR at byte 1");
  CHECK(shown("7f7f6161ffff") == "CBOR is no CBOR at byte 1");
  CHECK(shown("a10101") == "CBOR has a key that is no text at byte 1");
  CHECK(shown("a2 6161 01 20 01") == "CBOR has a key that is no text at byte 4");
  CHECK(shown("81f7") == "CBOR has undefined, which is no value, at byte 1");
  CHECK(shown("9bffffffffffffffff00") == "CBOR is no CBOR at byte 10");
  CHECK(shown("a2616101616102") == "CBOR has the key 'a' twice");
  CHECK(shown("c11a514b67b0") == "CBOR has the tag 1 before what is no bytes (byte 1)");
}

TEST_CASE("cbor: texts and keys are UTF-8") {
  CHECK(shown("62c3bc") == "\"\xc3\xbc\"");
  CHECK(shown("7f62c3bc6161ff") ==
        "\"\xc3\xbc"
        "a\"");
  CHECK(shown("61ff") == "CBOR has a text that is not UTF-8 at byte 0");
  CHECK(shown("8261 61 62c328") == "CBOR has a text that is not UTF-8 at byte 3");
  CHECK(shown("7f6161 61ff ff") == "CBOR has a text that is not UTF-8 at byte 0");
  CHECK(shown("a1 62eda0 01") == "CBOR has a text that is not UTF-8 at byte 1");
  CHECK(shown("d84041ff") == R"({"bytes":[255],"subtype":64})");
}

TEST_CASE("cbor: nothing nests without end") {
  const std::size_t count = 1'000'000;
  for (const auto* first : {"c6", "d840", "d9d9f7", "7f", "5f", "81", "9f", "a160", "bf60"}) {
    INFO(first);
    CHECK_FALSE(read_cbor(from_hex(starting_with(first, count))).has_value());
  }
  CHECK(shown(starting_with("81", 65) + "00") == "CBOR is nested deeper than 64 levels");
  CHECK(read_cbor(from_hex(starting_with("81", 64) + "00")).has_value());
}
