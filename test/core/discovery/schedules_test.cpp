#include "core/discovery/schedules.hpp"

#include <catch2/catch.hpp>

using namespace rr;
using std::chrono::milliseconds;

TEST_CASE("announcing: half a second after a reason, then once a period") {
  const TimePoint start{};
  AnnounceSchedule schedule;
  CHECK_FALSE(schedule.poll_timeout().has_value());
  CHECK_FALSE(schedule.take_due(start));
  schedule.announce_soon(start);
  CHECK(schedule.poll_timeout() == start + milliseconds(500));
  schedule.announce_soon(start + milliseconds(400));
  CHECK(schedule.poll_timeout() == start + milliseconds(500));
  CHECK_FALSE(schedule.take_due(start + milliseconds(499)));
  CHECK(schedule.take_due(start + milliseconds(500)));
  CHECK(schedule.poll_timeout() == start + milliseconds(55'500));

  schedule.announce_soon(start + milliseconds(1000));
  CHECK(schedule.poll_timeout() == start + milliseconds(1500));
  CHECK(schedule.take_due(start + milliseconds(1600)));
  CHECK(schedule.poll_timeout() == start + milliseconds(56'600));
  schedule.announce_soon(start + milliseconds(56'400));
  CHECK(schedule.poll_timeout() == start + milliseconds(56'600));
}

TEST_CASE("asking: three times at random intervals") {
  for (int round = 0; round < 200; ++round) {
    TimePoint now{};
    RequestSchedule schedule;
    CHECK_FALSE(schedule.poll_timeout().has_value());
    schedule.start(now);
    for (int request = 0; request < 3; ++request) {
      REQUIRE(schedule.poll_timeout());
      const auto wait = *schedule.poll_timeout() - now;
      CHECK(wait >= milliseconds(request == 0 ? 250 : 900));
      CHECK(wait <= milliseconds(request == 0 ? 1000 : 1500));
      CHECK_FALSE(schedule.take_due(*schedule.poll_timeout() - milliseconds(1)));
      now = *schedule.poll_timeout();
      CHECK(schedule.take_due(now));
    }
    CHECK_FALSE(schedule.poll_timeout().has_value());
    CHECK_FALSE(schedule.take_due(now + milliseconds(10'000)));
  }
}
