// Two ways of doing the same work, measured in turn within one run, so that the machine's moods hit both alike.
#pragma once

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <numeric>
#include <string>
#include <vector>

namespace rr::bench {

struct Samples {
  std::vector<double> nanoseconds = {};

  /// {"min": ..., "p50": ..., "p99": ..., "mean": ...}; the mean of all but the slowest hundredth, which other programs
  /// of the machine decide.
  std::string to_json() const {
    auto sorted = nanoseconds;
    std::sort(sorted.begin(), sorted.end());
    const std::size_t most = sorted.size() - sorted.size() / 100;
    const double sum = std::accumulate(sorted.begin(), sorted.begin() + static_cast<std::ptrdiff_t>(most), 0.0);
    char text[200];
    std::snprintf(text, sizeof text, "{\"min\": %.1f, \"p50\": %.1f, \"p99\": %.1f, \"mean\": %.1f}", sorted.front(),
                  sorted[sorted.size() / 2], sorted[most - 1], sum / static_cast<double>(most));
    return text;
  }
};

template <class Work>
double time_of(Work&& work) {
  const auto start = std::chrono::steady_clock::now();
  work();
  return std::chrono::duration<double, std::nano>(std::chrono::steady_clock::now() - start).count();
}

/// One line of JSON for run.py.
inline void print(const std::string& name, const Samples& ours, const Samples& yardstick) {
  std::printf("{\"name\": \"%s\", \"rounds\": %zu, \"ours\": %s, \"yardstick\": %s}\n", name.c_str(),
              ours.nanoseconds.size(), ours.to_json().c_str(), yardstick.to_json().c_str());
  std::fflush(stdout);
}

/// Runs `ours` and `yardstick` in turn after a warm-up, `rounds` times or for ten seconds, and prints the result.
template <class Ours, class Yardstick>
void compare(const std::string& name, int rounds, Ours&& ours, Yardstick&& yardstick) {
  Samples our_samples;
  Samples yardstick_samples;
  const int warm_up = rounds / 10 + 1;
  const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(10);
  for (int round = -warm_up; round < rounds; ++round) {
    if (std::chrono::steady_clock::now() > end) {
      if (!our_samples.nanoseconds.empty()) break;
      if (round < 0) round = 0;  // too slow for a warm-up
    }
    const double our_time = time_of(ours);
    const double yardstick_time = time_of(yardstick);
    if (round < 0) continue;
    our_samples.nanoseconds.push_back(our_time);
    yardstick_samples.nanoseconds.push_back(yardstick_time);
  }
  print(name, our_samples, yardstick_samples);
}

}  // namespace rr::bench
