// Times of the system's clock, and as text.
#include "node/platform/utc_time.hpp"

#include <catch2/catch.hpp>

using rr::TimeSpec;

TEST_CASE("utc time: a time before 1970 has a positive rest", "[utc]") {
  const auto time = std::chrono::system_clock::time_point(std::chrono::milliseconds(-1));
  CHECK(rr::to_time_spec(time) == TimeSpec{-1, 999'000'000});
}

TEST_CASE("utc time: UTC as text is cut behind the digits that are wanted", "[utc]") {
  CHECK(rr::format_utc({0, 1}, 9) == "1970-01-01T00:00:00.000000001Z");
  CHECK(rr::format_utc({1'795'532'400, 999'999'999}, 3) == "2026-11-24T15:00:00.999Z");
}
