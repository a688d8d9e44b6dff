#include "core/types/number.hpp"

#include <catch2/catch.hpp>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <limits>
#include <random>

using namespace rr;

namespace {

/// The converted number, or the conversion's verdict as text.
template <class To, class From>
std::string convert(From from) {
  Scalar out;
  switch (convert_number(Scalar::of(from), data_type_of<To>(), out)) {
    case Conversion::wrong_kind:
      return "wrong kind";
    case Conversion::out_of_range:
      return "out of range";
    case Conversion::ok:
      break;
  }
  CHECK(out.type == data_type_of<To>());
  return number_text(out);
}

template <class T>
using Limits = std::numeric_limits<T>;

}  // namespace

TEST_CASE("integers convert within the range of the target, both ends included") {
  CHECK(convert<std::uint8_t>(std::int32_t{255}) == "255");
  CHECK(convert<std::uint8_t>(std::int32_t{256}) == "out of range");
  CHECK(convert<std::uint8_t>(std::int32_t{-1}) == "out of range");
  CHECK(convert<std::int8_t>(std::int64_t{-128}) == "-128");
  CHECK(convert<std::int8_t>(std::int64_t{-129}) == "out of range");
  CHECK(convert<std::int8_t>(std::uint64_t{127}) == "127");
  CHECK(convert<std::int8_t>(std::uint64_t{128}) == "out of range");
  CHECK(convert<std::int64_t>(Limits<std::uint64_t>::max()) == "out of range");
  CHECK(convert<std::uint64_t>(Limits<std::int64_t>::max()) == "9223372036854775807");
  CHECK(convert<std::uint64_t>(Limits<std::int64_t>::min()) == "out of range");
  CHECK(convert<std::int64_t>(Limits<std::int64_t>::min()) == "-9223372036854775808");
  CHECK(convert<std::int64_t>(Limits<std::int32_t>::min()) == "-2147483648");
  CHECK(convert<std::int16_t>(std::int8_t{-1}) == "-1");
}

TEST_CASE("integers convert to floating types that hold exactly this value") {
  CHECK(convert<double>(std::int64_t{1} << 53) == "9.00719925e+15");
  CHECK(convert<double>((std::int64_t{1} << 53) + 1) == "out of range");
  CHECK(convert<double>(Limits<std::uint64_t>::max()) == "out of range");
  CHECK(convert<double>(Limits<std::int64_t>::min()) == "-9.22337204e+18");
  CHECK(convert<float>(std::int32_t{1 << 24}) == "16777216");
  CHECK(convert<float>(std::int32_t{(1 << 24) + 1}) == "out of range");
  CHECK(convert<CSingle>(std::int8_t{-3}) == "-3+0i");
}

TEST_CASE("floating values convert to integers where they have no fraction") {
  CHECK(convert<std::int32_t>(5.0) == "5");
  CHECK(convert<std::int32_t>(-0.0) == "0");
  CHECK(convert<std::int32_t>(-5.0f) == "-5");
  CHECK(convert<std::int32_t>(1.5) == "wrong kind");
  CHECK(convert<std::int32_t>(3e9) == "out of range");
  CHECK(convert<std::uint32_t>(3e9) == "3000000000");
  CHECK(convert<std::uint64_t>(0x1p63) == "9223372036854775808");
  CHECK(convert<std::uint64_t>(0x1p64) == "out of range");
  CHECK(convert<std::int64_t>(-0x1p63) == "-9223372036854775808");
  CHECK(convert<std::int64_t>(0x1p63) == "out of range");
  CHECK(convert<std::int32_t>(std::nan("")) == "wrong kind");
  CHECK(convert<std::int32_t>(HUGE_VAL) == "wrong kind");
}

TEST_CASE("double rounds to single but never to infinity") {
  CHECK(convert<float>(0.1) == "0.100000001");
  CHECK(convert<float>(1e300) == "out of range");
  CHECK(convert<float>(3.4028235677973362e38) == "3.40282347e+38");
  CHECK(convert<float>(0x1.ffffffp127) == "out of range");
  CHECK(convert<float>(HUGE_VAL) == "inf");
  CHECK(convert<float>(std::nan("")) == "nan");
  CHECK(convert<double>(0.1f) == "0.100000001");
}

TEST_CASE("complex numbers take real ones, not the other way") {
  CHECK(convert<CDouble>(1.5) == "1.5+0i");
  CHECK(convert<CDouble>(CSingle(1, -2)) == "1-2i");
  CHECK(convert<CSingle>(CDouble(1, 1e300)) == "out of range");
  CHECK(convert<double>(CDouble(1, 0)) == "wrong kind");
  CHECK(convert<std::int32_t>(CDouble(1, 0)) == "wrong kind");
}

TEST_CASE("bool is a kind of its own") {
  CHECK(convert<bool>(true) == "true");
  CHECK(convert<std::int32_t>(true) == "wrong kind");
  CHECK(convert<bool>(std::int32_t{1}) == "wrong kind");
  CHECK(convert<bool>(1.0) == "wrong kind");
  Scalar out;
  CHECK(convert_number(Scalar::of(1.0), DataType::string_t, out) == Conversion::wrong_kind);
}

TEST_CASE("floating values are written like those of C") {
  std::mt19937_64 random(20240607);
  const auto check = [](double value) {
    char expected[40];
    std::snprintf(expected, sizeof(expected), "%.9g", value);
    CHECK(number_text(Scalar::of(value)) == expected);
  };
  for (const double value : {0.0,          -0.0,
                             1.0,          -1.5,
                             100.0,        123456789.0,
                             999999999.0,  999999999.6,
                             1234567890.0, 1e9,
                             0.1,          1e-4,
                             0.00012345,   9.9999999996e-5,
                             1e-5,         1e-10,
                             1e100,        1.7976931348623157e308,
                             5e-324,       2.5e-310,
                             HUGE_VAL,     -HUGE_VAL,
                             0.5})
    check(value);
  CHECK(number_text(Scalar::of(std::nan(""))) == "nan");
  for (int i = 0; i < 20'000; ++i) {
    const auto bits = random();
    double value = 0;
    std::memcpy(&value, &bits, sizeof(value));
    if (!std::isnan(value)) check(value);
  }
}
