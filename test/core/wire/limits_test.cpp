// What a message may ask for beyond its own bytes: bounded by the receiver's limit for messages.
#include <catch2/catch.hpp>

#include "core/wire/codec.hpp"
#include "test/core/wire/coded_message.hpp"

using namespace rr;
using namespace rr::test;

namespace {

std::string decode_error(const Bytes& bytes, std::size_t message_limit) {
  Message message;
  const DecodeOptions options{.string_table = {.local = true, .standard = true}, .message_limit = message_limit};
  const auto decoded = decode(bytes, options, message);
  return decoded ? "decoded" : decoded.error().message;
}

}  // namespace

TEST_CASE("texts behind codes count each time they are named, up to four times the limit for messages") {
  const std::string text(1000, 'a');
  CHECK(decode_error(coded_message(text, coded_element(), 16), 4000) == "decoded");
  CHECK(decode_error(coded_message(text, coded_element(), 17), 4000) ==
        "ElementName at byte 1134: the texts behind string codes are more than 16000 bytes");
  CHECK(decode_error(coded_message(text, coded_map(coded_element(), 1), 8), 4000) == "decoded");
  CHECK(decode_error(coded_message(text, coded_map(coded_element(), 1), 9), 4000) != "decoded");
  // Under the usual limit: half a megabyte that would become eleven gigabytes.
  CHECK(decode_error(coded_message(std::string(250'000, 'a'), coded_element(), 45'000), 12u << 20) != "decoded");
}

TEST_CASE("texts of types count too") {
  const std::string text(1000, 'a');
  const Bytes element{7, 0x02 | 0x10, 1, 101, 0, 1, 0};  // a structure whose name and type have the code 1
  CHECK(decode_error(coded_message(text, element, 8), 4000) == "decoded");
  CHECK(decode_error(coded_message(text, element, 9), 4000) != "decoded");
}

TEST_CASE("a message has one element for twelve bytes of the limit, and 65536 always") {
  const Bytes element{5, 0, 0, 0, 0};
  CHECK(decode_error(coded_message("", element, 65536), 16384) == "decoded");
  CHECK(decode_error(coded_message("", element, 65537), 16384).find("more than 65536 elements in one message") !=
        std::string::npos);
  CHECK(decode_error(coded_message("", element, 100'000), 1'200'000) == "decoded");
  CHECK(decode_error(coded_message("", element, 100'001), 1'200'000) != "decoded");
}

TEST_CASE("room for elements grows no further than the bytes left can fill") {
  Message message;
  const std::size_t count = 70'000;
  const auto bytes = coded_message("", {5, 0, 0, 0, 0}, count);
  REQUIRE(decode(bytes, {.string_table = {.local = true}}, message).has_value());
  CHECK(message.elements.size() == count);
  CHECK(message.elements.capacity() == count);
}
