// Who is sent what one member says: a wire's connections, a pipe's endpoints, an event's clients. Layer: member.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <utility>
#include <vector>

namespace rr {

/// What becomes of a packet that some followers were not sent yet when the next one comes.
enum class FollowRule : std::uint8_t {
  newest,    ///< wires: it is replaced
  in_order,  ///< pipes, events: it waits, and comes first
};

/// The followers of one member of one object. Every packet is made once and handed out to all of them, in turns of a
/// bounded length, so that thousands of followers keep nobody else waiting. Without followers a packet costs nothing.
///
/// The owner calls hand_out() behind push(), and again, behind everybody else's work, as long as it returns true. What
/// waits for one follower's stream is that follower's business: its session has a queue with a bound, and a ledger.
///
/// `Follower`  names one, and compares: a client, or a client and its endpoint.
/// `Packet`    is what they are sent; shared where it is large.
template <class Follower, class Packet>
class FollowerList {
 public:
  static constexpr std::size_t turn = 64;           ///< deliveries before everybody else gets a turn
  static constexpr std::size_t max_waiting = 1024;  ///< packets; above, all are handed out in one turn

  explicit FollowerList(FollowRule rule) : rule_(rule) {}

  /// It is sent what comes from now on.
  void add(Follower follower) { followers_.push_back({std::move(follower), end()}); }
  /// Returns whether it was there.
  bool remove(const Follower& follower) {
    const auto found = std::find_if(followers_.begin(), followers_.end(),
                                    [&](const Place& place) { return place.follower == follower; });
    if (found == followers_.end()) return false;
    if (found - followers_.begin() < static_cast<std::ptrdiff_t>(next_)) --next_;
    followers_.erase(found);
    return true;
  }
  bool empty() const { return followers_.empty(); }
  std::size_t size() const { return followers_.size(); }

  /// Returns  whether hand_out() is due now: there are followers, and it neither runs nor has to be called again
  /// anyway.
  bool push(Packet packet) {
    if (followers_.empty()) return false;
    if (rule_ == FollowRule::newest) forget(waiting_.size());
    waiting_.push_back(std::move(packet));
    return !std::exchange(is_due_, true);
  }

  /// Calls `send(follower, packet, missed)` for those whose turn it is; `missed` packets were replaced by this one.
  /// Followers may come and go, and packets be pushed, while it runs.
  /// Returns  whether it has to be called again.
  template <class Send>
  bool hand_out(Send&& send) {
    std::size_t up_to_date = 0;  // in a row
    for (std::size_t sent = 0; sent < turn || waiting_.size() > max_waiting;) {
      if (up_to_date >= followers_.size()) {
        forget(waiting_.size());
        return is_due_ = false;
      }
      if (next_ >= followers_.size()) begin_round();
      auto& place = followers_[next_++];
      if (place.number >= end()) {
        ++up_to_date;
        continue;
      }
      up_to_date = 0;
      ++sent;
      const auto missed = place.number < first_ ? first_ - place.number : 0;
      place.number = std::max(place.number, first_);
      const Packet packet = waiting_[static_cast<std::size_t>(place.number++ - first_)];
      const Follower follower = place.follower;
      send(follower, packet, missed);
    }
    return true;
  }

 private:
  struct Place {
    Follower follower;
    std::uint64_t number;  ///< of the packet that it is sent next
  };

  std::uint64_t end() const { return first_ + waiting_.size(); }
  void forget(std::size_t packets) {
    waiting_.erase(waiting_.begin(), waiting_.begin() + static_cast<std::ptrdiff_t>(packets));
    first_ += packets;
  }
  /// All have had their turn: what everybody has been sent is done with.
  void begin_round() {
    next_ = 0;
    auto slowest = end();
    for (const auto& place : followers_) slowest = std::min(slowest, place.number);
    if (slowest > first_) forget(static_cast<std::size_t>(slowest - first_));
  }

  FollowRule rule_;
  std::vector<Place> followers_;
  std::size_t next_ = 0;  ///< whose turn it is
  std::deque<Packet> waiting_;
  std::uint64_t first_ = 0;  ///< number of the first packet that waits
  bool is_due_ = false;
};

}  // namespace rr
