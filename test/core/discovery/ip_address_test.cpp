#include "core/discovery/ip_address.hpp"

#include <catch2/catch.hpp>
#include <string>

using namespace rr;

namespace {

std::string bytes_of(std::string_view text) {
  const auto address = parse_ip_address(text);
  if (!address) return "none";
  std::string out;
  for (std::size_t i = 0; i < (address->is_v6 ? 16u : 4u); ++i) {
    constexpr char digits[] = "0123456789abcdef";
    out += digits[address->bytes[i] >> 4];
    out += digits[address->bytes[i] & 15];
  }
  return out;
}

}  // namespace

TEST_CASE("address literals are read") {
  CHECK(bytes_of("192.168.1.5") == "c0a80105");
  CHECK(bytes_of("0.0.0.0") == "00000000");
  CHECK(bytes_of("::") == "00000000000000000000000000000000");
  CHECK(bytes_of("::1") == "00000000000000000000000000000001");
  CHECK(bytes_of("fe80::") == "fe800000000000000000000000000000");
  CHECK(bytes_of("fe80::48ac:c24d:4a5b") ==
        "fe800000000000000000"
        "48acc24d4a5b");
  CHECK(bytes_of("1:2:3:4:5:6:7:8") == "00010002000300040005000600070008");
  CHECK(bytes_of("1:2:3:4:5:6:7::") == "00010002000300040005000600070000");
  CHECK(bytes_of("::ffff:10.0.0.1") == "00000000000000000000ffff0a000001");
  CHECK(bytes_of("1:2:3:4:5:6:10.0.0.1") == "0001000200030004000500060a000001");
  CHECK(parse_url_address("fe80::1%eth0") == parse_ip_address("fe80::1"));
}

TEST_CASE("what is no address literal is not taken for one") {
  for (const auto* text : {"",
                           "localhost",
                           "1.2.3",
                           "1.2.3.4.5",
                           "1.2.3.256",
                           "1.2.3.04",
                           "1.2..3",
                           "a.b.c.d",
                           "1.2.3.4 ",
                           ":",
                           ":::",
                           "1::2::3",
                           "1:2:3:4:5:6:7",
                           "1:2:3:4:5:6:7:8:9",
                           "1:2:3:4:5:6:7:8::",
                           "12345::",
                           "g::1",
                           "fe80::1:",
                           ":1::2",
                           "1:",
                           "10.0.0.1::",
                           "1:10.0.0.1:2::",
                           "fe80::1%eth0",
                           "::1.2.3.4.5",
                           "1:2:3:4:5:6:7:1.2.3.4"}) {
    INFO(text);
    CHECK_FALSE(parse_ip_address(text).has_value());
  }
}

TEST_CASE("scopes of addresses") {
  CHECK(parse_ip_address("127.3.2.1")->is_loopback());
  CHECK(parse_ip_address("::1")->is_loopback());
  CHECK_FALSE(parse_ip_address("::2")->is_loopback());
  CHECK_FALSE(parse_ip_address("::")->is_loopback());
  CHECK(parse_ip_address("169.254.9.9")->is_link_local());
  CHECK(parse_ip_address("fe80::1")->is_link_local());
  CHECK(parse_ip_address("febf::1")->is_link_local());
  CHECK_FALSE(parse_ip_address("fec0::1")->is_link_local());
  CHECK(parse_ip_address("fec0::1")->is_site_local());
  CHECK_FALSE(parse_ip_address("fd00::1")->is_site_local());
  CHECK_FALSE(parse_ip_address("192.168.0.1")->is_site_local());
}
