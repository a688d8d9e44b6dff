#include "core/support/whole_number.hpp"

#include <catch2/catch.hpp>

#include <cstdint>

using namespace rr;

TEST_CASE("whole numbers are all of their text, and fit") {
  CHECK(whole_number<std::int32_t>("-2147483648") == -2147483647 - 1);
  CHECK(whole_number<std::int32_t>("007") == 7);
  CHECK(whole_number<std::uint64_t>("18446744073709551615") == 18446744073709551615u);
  for (const auto* text : {"", "-", "+7", " 7", "7 ", "7.0", "0x7", "2147483648"})
    CHECK_FALSE(whole_number<std::int32_t>(text));
  CHECK_FALSE(whole_number<std::uint16_t>("-1"));
}

TEST_CASE("a canonical number has one spelling") {
  CHECK(canonical_number<std::int32_t>("0") == 0);
  CHECK(canonical_number<std::int32_t>("-70") == -70);
  for (const auto* text : {"", "007", "-0", "00", "+7"}) CHECK_FALSE(canonical_number<std::int32_t>(text));
}
