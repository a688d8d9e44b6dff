// Untrusted text in messages and logs.

#include <catch2/catch.hpp>
#include <string>

#include "core/support/error.hpp"
#include "core/support/utf8.hpp"

using rr::quote;

TEST_CASE("what is quoted is UTF-8, without control characters") {
  CHECK(quote("a'b\\c") == "'a\\'b\\\\c'");
  CHECK(quote("a\n\x1b[31m\x7f") == "'a\\x0a\\x1b[31m\\x7f'");
  CHECK(quote("\xc3\xa4 \xe2\x82\xac \xf0\x9f\xa4\x96") == "'\xc3\xa4 \xe2\x82\xac \xf0\x9f\xa4\x96'");
  CHECK(quote("\xff\xc3(\xed\xa0\x80") == "'\\xff\\xc3(\\xed\\xa0\\x80'");
  // U+009B begins a sequence for a terminal as ESC [ does. Its second byte alone is no UTF-8.
  CHECK(quote("\xc2\x9b"
              "31m\xc2\xa0") == "'\\xc2\\x9b31m\xc2\xa0'");
  std::string every;
  for (int i = 0; i < 256; ++i) every += static_cast<char>(i);
  for (std::size_t size = 1; size < every.size(); ++size) CHECK(rr::is_utf8(quote(every + every, size)));
}

TEST_CASE("what is quoted is cut between characters, and says how long it was") {
  const std::string text = "a\xe2\x82\xac";
  CHECK(quote(text, 4) == "'a\xe2\x82\xac'");
  CHECK(quote(text, 3) == "'a\\xe2\\x82' (4 bytes)");
}
