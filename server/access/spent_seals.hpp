// Seals that are good no more, though their time is not over. Layer: server/access.
#pragma once

#include <algorithm>
#include <chrono>
#include <map>
#include <string>
#include <string_view>
#include <utility>

#include "server/access/identity.hpp"

namespace rrgate {

/// Each until it would be too late. Bounded, and one subject's leave room for those of others.
class SpentSeals {
 public:
  using Time = std::chrono::system_clock::time_point;
  static constexpr std::size_t most = 65'536;
  static constexpr std::size_t most_of_subject = 4'096;

  bool has(std::string_view id) const { return spent_.contains(id); }

  /// `subject`  what tells whose it is. False: it is here already, or there are too many.
  bool add(std::string id, std::string subject, Time ends, Time now) {
    if (has(id)) return false;
    if (is_full(subject) && now >= earliest_) forget_late(now);
    if (is_full(subject)) return false;
    earliest_ = std::min(earliest_, ends);
    ++counts_[subject];
    spent_.emplace(std::move(id), Spent{ends, std::move(subject)});
    return true;
  }

 private:
  struct Spent {
    Time ends;
    std::string subject;
  };

  bool is_full(const std::string& subject) const {
    const auto found = counts_.find(subject);
    return spent_.size() >= most || (found != counts_.end() && found->second >= most_of_subject);
  }
  void forget_late(Time now) {
    counts_.clear();
    earliest_ = Time::max();
    std::erase_if(spent_, [now](const auto& each) { return each.second.ends <= now; });
    for (const auto& [id, each] : spent_) {
      ++counts_[each.subject];
      earliest_ = std::min(earliest_, each.ends);
    }
  }

  std::map<std::string, Spent, std::less<>> spent_;
  std::map<std::string, std::size_t> counts_;
  Time earliest_ = Time::max();
};

}  // namespace rrgate
