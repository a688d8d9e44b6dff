#include "core/support/utf8.hpp"

#include <catch2/catch.hpp>
#include <string>

using namespace rr;

namespace {

/// UTF-8 as its definition has it, for every code up to 0x1fffff, whether there is such a character or not.
std::string encoded(unsigned code) {
  const auto tail = [&](int shift) { return static_cast<char>(0x80 | (code >> shift & 0x3f)); };
  if (code < 0x80) return {static_cast<char>(code)};
  if (code < 0x800) return {static_cast<char>(0xc0 | code >> 6), tail(0)};
  if (code < 0x10000) return {static_cast<char>(0xe0 | code >> 12), tail(6), tail(0)};
  return {static_cast<char>(0xf0 | code >> 18), tail(12), tail(6), tail(0)};
}

}  // namespace

TEST_CASE("every character is UTF-8, surrogates and what lies above are not") {
  bool is_right = true;
  for (unsigned code = 0; code < 0x200000; ++code)
    is_right = is_right && is_utf8(encoded(code)) == ((code < 0xd800 || code > 0xdfff) && code <= 0x10ffff);
  CHECK(is_right);
}

TEST_CASE("broken and overlong forms are not UTF-8") {
  CHECK(is_utf8(""));
  CHECK(is_utf8("plain, \xc3\xa9, \xe2\x82\xac, \xf0\x9f\xa4\x96, plain"));
  for (const auto* bad :
       {"\x80", "\xbf", "\xc0\x80", "\xc1\xbf", "\xc3", "\xc3(", "\xe0\x9f\xbf", "\xe2\x82", "\xe2(\xa1", "\xe2\x82(",
        "\xf0\x8f\xbf\xbf", "\xf0\x9f\xa4", "\xf8\x88\x80\x80\x80", "\xff", "plain\xe9"}) {
    INFO(bad);
    CHECK_FALSE(is_utf8(bad));
    CHECK_FALSE(is_utf8(bad + std::string("plain")));
  }
}

TEST_CASE("text is cut between characters") {
  const std::string text = "a\xc3\xa9\xe2\x82\xac";  // of 1, 2 and 3 bytes
  const std::size_t kept[] = {0, 1, 1, 3, 3, 3, 6, 6};
  for (std::size_t limit = 0; limit < 8; ++limit) CHECK(utf8_prefix(text, limit) == text.substr(0, kept[limit]));
  const std::string bytes = "admin" + std::string(8, '\x80');
  CHECK(utf8_prefix(bytes, 12) == bytes.substr(0, 12));
  CHECK(utf8_prefix("\x80\x80\x80", 2) == "\x80\x80");
}

TEST_CASE("utf8: code points of one to four bytes", "[support]") {
  std::string out;
  for (const std::uint32_t code : {0x7fu, 0x80u, 0x7ffu, 0x800u, 0xffffu, 0x10000u, 0x10ffffu}) {
    rr::append_utf8(out, code);
    out += ' ';
  }
  CHECK(out == "\x7f \xc2\x80 \xdf\xbf \xe0\xa0\x80 \xef\xbf\xbf \xf0\x90\x80\x80 \xf4\x8f\xbf\xbf ");
}
