#include "node/tls/base64.hpp"

#include <catch2/catch.hpp>

using namespace rr;

TEST_CASE("bytes are written as Base64 and read back") {
  // RFC 4648, section 10.
  const std::pair<std::string, std::string> known[] = {{"", ""},
                                                       {"f", "Zg=="},
                                                       {"fo", "Zm8="},
                                                       {"foo", "Zm9v"},
                                                       {"foob", "Zm9vYg=="},
                                                       {"fooba", "Zm9vYmE="},
                                                       {"foobar", "Zm9vYmFy"}};
  for (const auto& [plain, text] : known) {
    CHECK(encode_base64(as_bytes(plain)) == text);
    const auto bytes = decode_base64(text);
    REQUIRE(bytes);
    CHECK(as_text(*bytes) == plain);
  }
  Bytes all;
  for (int i = 0; i < 256; ++i) all.push_back(static_cast<std::uint8_t>(i));
  for (; !all.empty(); all.pop_back()) CHECK(decode_base64(encode_base64(all)) == all);
}

TEST_CASE("only the one spelling of bytes as Base64 is read") {
  using namespace std::string_literals;
  for (const auto& bad : {"Z"s, "Zg"s, "Zg="s, "Zh=="s, "Zm9="s, "Zg==Zg=="s, "===="s, "Z==="s, "=Zg="s, "Zm9v\n"s,
                          " Zm9v   "s, "Zm9v    "s, "    "s, "Zm-_"s, "Zm9\0"s, "Zm\xff\xff"s, "Zg==\0\0\0\0"s}) {
    INFO(bad);
    CHECK_FALSE(decode_base64(bad));
  }
}
