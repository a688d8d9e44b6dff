// What every client of the latency table does: calls as often as it is told, and says how long each call took.
#pragma once

#include <chrono>
#include <cstdint>
#include <cstdio>
#include <vector>

namespace rr::bench {

/// After a warm-up says "ready". Then, for each count on standard input, makes so many calls and writes the nanoseconds
/// of each (uint32, of this machine's byte order); returns when the input ends.
template <class Call>
void answer_counts(Call&& call) {
  for (int i = 0; i < 1000; ++i) call();
  std::puts("ready");
  std::fflush(stdout);
  std::vector<std::uint32_t> samples;
  for (std::size_t count = 0; std::scanf("%zu", &count) == 1;) {
    samples.resize(count);
    for (auto& sample : samples) {
      const auto start = std::chrono::steady_clock::now();
      call();
      sample = static_cast<std::uint32_t>((std::chrono::steady_clock::now() - start).count());
    }
    std::fwrite(samples.data(), sizeof samples[0], samples.size(), stdout);
    std::fflush(stdout);
  }
}

}  // namespace rr::bench
