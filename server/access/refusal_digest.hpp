// Refusals of strangers, of whom there may be any number, in few lines of a log. Layer: server/access.
#pragma once

#include <chrono>
#include <cstdint>
#include <map>
#include <string>
#include <utility>
#include <vector>

namespace rrgate {

/// Of each network the first refusals of a minute are written, and the others are counted.
class RefusalDigest {
 public:
  using Time = std::chrono::steady_clock::time_point;
  static constexpr std::chrono::minutes period{1};
  struct Sum {
    std::string network;  ///< empty: of all that were too many to be told apart
    std::uint64_t count = 0;
  };

  /// `written`  how many of a network are written in a minute.
  explicit RefusalDigest(std::uint64_t written = 1) : written_(written) {}

  /// Notes a refusal. Returns whether it is to be written.
  bool note(const std::string& network, Time now) {
    if (counts_.empty()) begun_ = now;
    const bool has_room = counts_.size() < max_networks;
    const auto found = has_room ? counts_.try_emplace(network, 0).first : counts_.find(network);
    if (found != counts_.end()) return ++found->second <= written_;
    ++others_;
    return false;
  }
  /// What was counted in a minute that is over, or (`is_forced`) until now.
  std::vector<Sum> take(Time now, bool is_forced = false) {
    std::vector<Sum> out;
    if (counts_.empty() || (!is_forced && now - begun_ < period)) return out;
    for (const auto& [network, count] : std::exchange(counts_, {}))
      if (count > written_) out.push_back({network, count - written_});
    if (const auto count = std::exchange(others_, 0); count > 0) out.push_back({{}, count});
    return out;
  }

 private:
  static constexpr std::size_t max_networks = 100;

  std::uint64_t written_;
  std::map<std::string, std::uint64_t> counts_;  ///< all of them
  std::uint64_t others_ = 0;
  Time begun_{};
};

}  // namespace rrgate
