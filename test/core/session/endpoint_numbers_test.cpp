#include "core/session/service/endpoint_numbers.hpp"

#include <catch2/catch.hpp>
#include <vector>

using namespace rr;

TEST_CASE("no two sessions of a node have one number, and one that was left rests for five minutes") {
  const std::vector<std::uint32_t> drawn{7, 7, 8, 7, 9, 7};
  std::size_t next = 0;
  EndpointNumbers numbers([&] { return drawn.at(next++); });
  const TimePoint start = TimePoint{} + std::chrono::hours(1);
  CHECK(numbers.take(start) == 7);
  CHECK(numbers.take(start) == 8);
  numbers.give_back(7, start);
  CHECK(numbers.take(start + std::chrono::seconds(299)) == 9);
  CHECK(numbers.take(start + std::chrono::seconds(300)) == 7);
}
