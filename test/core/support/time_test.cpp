// Times of peers: any two numbers.
#include "core/support/time.hpp"

#include <catch2/catch.hpp>
#include <limits>

using rr::TimeSpec;

namespace {

constexpr auto max_seconds = std::numeric_limits<std::int64_t>::max();
constexpr auto min_seconds = std::numeric_limits<std::int64_t>::min();

}  // namespace

TEST_CASE("time: seconds and nanoseconds get one sign", "[support]") {
  CHECK(TimeSpec{1, 2'000'000'001}.normalized() == TimeSpec{3, 1});
  CHECK(TimeSpec{1, -1}.normalized() == TimeSpec{0, 999'999'999});
  CHECK(TimeSpec{-1, 1}.normalized() == TimeSpec{0, -999'999'999});
  CHECK(TimeSpec{-1, -2'000'000'001}.normalized() == TimeSpec{-3, -1});
}

TEST_CASE("time: what no time can tell becomes the first or the last one", "[support]") {
  const TimeSpec last{max_seconds, 999'999'999};
  const TimeSpec first{min_seconds, -999'999'999};
  CHECK(TimeSpec{max_seconds, 2'000'000'000}.normalized() == last);
  CHECK(TimeSpec{max_seconds - 1, 2'147'483'647}.normalized() == last);
  CHECK(TimeSpec{min_seconds, -2'000'000'000}.normalized() == first);
  CHECK(TimeSpec{max_seconds - 2, 2'147'483'647}.normalized() == TimeSpec{max_seconds, 147'483'647});
  CHECK(TimeSpec{max_seconds, -1}.normalized() == TimeSpec{max_seconds - 1, 999'999'999});
  CHECK(last.plus_one_nanosecond() == last);
  CHECK(TimeSpec{4, 2'147'483'647}.plus_one_nanosecond() == TimeSpec{6, 147'483'648});
}
