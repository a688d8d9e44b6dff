#include "core/support/words.hpp"

#include <catch2/catch.hpp>

TEST_CASE("words: blanks are taken off both ends, and what counts as one may be said", "[support]") {
  CHECK(rr::trim(" \ta b\t ") == "a b");
  CHECK(rr::trim("a\r\n") == "a\r\n");
  CHECK(rr::trim("a\r\n", "\r\n") == "a");
  CHECK(rr::trim(" \t").empty());
  CHECK(rr::trim("").empty());
}
