#include "server/upstream/look_pace.hpp"

#include <catch2/catch.hpp>
#include <map>

using rrgate::LookPace;
using namespace std::chrono_literals;

namespace {

/// When the last of so many looks begins that are wanted at once.
std::chrono::steady_clock::duration last_turn(LookPace& pace, LookPace::Look look, LookPace::TimePoint now, int count) {
  auto turn = now;
  for (int i = 0; i < count; ++i) turn = pace.take_turn(look, now);
  return turn - now;
}

}  // namespace

TEST_CASE("few devices are looked at without waiting") {
  LookPace pace;
  LookPace::TimePoint now{1h};
  for (int round = 0; round < 10; ++round, now += 10s) {
    CHECK(last_turn(pace, LookPace::Look::first, now, LookPace::at_once) == 0s);
    CHECK(last_turn(pace, LookPace::Look::later, now, LookPace::at_once) == 0s);
  }
}

TEST_CASE("thousands of devices are looked at one after another, the first time sooner") {
  LookPace pace;
  const LookPace::TimePoint now{1h};
  const auto first = last_turn(pace, LookPace::Look::first, now, 5000);
  CHECK(first == 4900ms);
  const auto later = last_turn(pace, LookPace::Look::later, now, 5000);
  CHECK(later == 39200ms);
  // They took their turns: whoever comes now is behind them, and none waits once those are over.
  CHECK(pace.take_turn(LookPace::Look::later, now + 20s) - now == 39300ms);
  CHECK(pace.take_turn(LookPace::Look::later, now + 60s) == now + 60s);
}

TEST_CASE("looks that wait begin several at a time, ten times a second") {
  LookPace pace;
  const LookPace::TimePoint now{1h + 37ms};
  std::map<LookPace::TimePoint, int> begun;
  for (int i = 0; i < 5000; ++i) ++begun[pace.take_turn(LookPace::Look::later, now)];
  CHECK(begun[now] == LookPace::at_once);
  begun.erase(now);
  CHECK(begun.size() == 393);
  auto due = now;
  for (const auto& [turn, count] : begun) {
    CHECK(turn.time_since_epoch() % 100ms == 0s);
    CHECK(turn - due < 200ms);
    CHECK(count <= 13);
    due = turn;
  }
}
