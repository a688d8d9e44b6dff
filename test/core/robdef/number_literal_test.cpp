// FLOAT literals against the C library's own conversion, which rounds correctly too.
#include "core/robdef/model/number_literal.hpp"

#include <catch2/catch.hpp>
#include <cmath>
#include <cstdlib>
#include <random>
#include <string>

namespace {

using namespace rr;

void check(const std::string& text) {
  INFO(text);
  REQUIRE(is_float_literal(text));
  CHECK(parse_float_literal(text, false) == std::strtod(text.c_str(), nullptr));
  CHECK(parse_float_literal(text, true) == static_cast<double>(std::strtof(text.c_str(), nullptr)));
}

}  // namespace

TEST_CASE("Float literals are rounded like those of C") {
  for (const auto* text : {
           "0",
           "0.0",
           "1",
           "-1.5",
           "+.5",
           "5.",
           "3.14159",
           "1e22",
           "1e23",
           "123456789012345678",
           "9007199254740993",
           "9007199254740992.99999999999999999999999",
           "9007199254740993.0000000000000000000000001",
           "0.1",
           "1e-5",
           // The borders of double: largest, halfway to infinity, smallest normal, smallest, half of it, just above.
           "1.7976931348623157e308",
           "1.7976931348623158079e308",
           "1.7976931348623159e308",
           "2.2250738585072014e-308",
           "2.2250738585072011e-308",
           "4.9406564584124654e-324",
           "2.4703282292062327e-324",
           "2.4703282292062328e-324",
           "1e-400",
           "1e400",
           "1e-1000000000000",
           "1e1000000000000",
           "0e1000000000000",
           // Of single.
           "3.4028234663852886e38",
           "3.4028235677973366e38",
           "3.4028235677973362e38",
           "1.1754943508222875e-38",
           "1.4012984643248171e-45",
           "7.006492321624085e-46",
           "7.006492321624086e-46",
           "16777217",
           "16777217.0000001",
       })
    check(text);
  // A halfway case that its last digit decides, and more digits than any halfway case has.
  check("0." + std::string(320, '0') + "1" + std::string(900, '3'));
  check(std::string(300, '9') + "." + std::string(900, '9'));
  check("9007199254740993" + std::string(".") + std::string(900, '0') + "1");
  check("1" + std::string(1200, '0') + "e-1200");
}

TEST_CASE("Float literals at random are rounded like those of C") {
  std::mt19937 random(20240607);
  const auto below = [&](std::uint32_t limit) { return static_cast<std::uint32_t>(random() % limit); };
  for (int i = 0; i < 20'000; ++i) {
    std::string text;
    const std::uint32_t digits = 1 + below(i % 50 == 0 ? 900 : 25);
    text += static_cast<char>('1' + below(9));
    for (std::uint32_t digit = 1; digit < digits; ++digit) text += static_cast<char>('0' + below(10));
    text.insert(1 + below(digits), ".");
    text += "e" + std::to_string(static_cast<int>(below(700)) - 350);
    check(text);
  }
}
