#include "core/support/utf8.hpp"

#include <catch2/catch.hpp>

TEST_CASE("utf8: code points of one to four bytes", "[support]") {
  std::string out;
  for (const std::uint32_t code : {0x7fu, 0x80u, 0x7ffu, 0x800u, 0xffffu, 0x10000u, 0x10ffffu}) {
    rr::append_utf8(out, code);
    out += ' ';
  }
  CHECK(out == "\x7f \xc2\x80 \xdf\xbf \xe0\xa0\x80 \xef\xbf\xbf \xf0\x90\x80\x80 \xf4\x8f\xbf\xbf ");
}
