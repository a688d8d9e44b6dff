// TLS handshakes that are not finished: few of one network at a time. Layer: server/state.
#pragma once

#include <boost/asio/as_tuple.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/asio/use_awaitable.hpp>
#include <boost/intrusive/list.hpp>
#include <chrono>
#include <map>
#include <string>
#include <utility>

#include "node/transport/byte_stream.hpp"

namespace rrgate {

/// Each unfinished handshake holds some 60 kB and costs the gateway's thread a signature. So of one network, as
/// network_name() has it, few go on at a time, and the others wait. For one thread; outlives its turns.
class HandshakeTurns {
 public:
  static constexpr std::size_t most = 4;

  /// A place in the line: waits, has its turn, and gives it up when it goes.
  class Turn : public boost::intrusive::list_base_hook<boost::intrusive::link_mode<boost::intrusive::auto_unlink>> {
   public:
    Turn(HandshakeTurns& turns, std::string network, const boost::asio::any_io_executor& executor)
        : turns_(turns), network_(std::move(network)), timer_(executor) {}
    Turn(const Turn&) = delete;
    Turn& operator=(const Turn&) = delete;
    ~Turn() {
      if (has_come_) turns_.end(network_);
    }

    /// Once. False: it has not come within `timeout`, or cancel() was called.
    rr::awaitable<bool> come(std::chrono::milliseconds timeout) {
      auto& line = turns_.lines_[network_];
      if (line.going < most) {
        ++line.going;
        has_come_ = true;
        co_return true;
      }
      line.waiting.push_back(*this);
      timer_.expires_after(timeout);
      co_await timer_.async_wait(boost::asio::as_tuple(boost::asio::use_awaitable));
      unlink_if_waiting();
      co_return has_come_;
    }
    void cancel() {
      unlink_if_waiting();
      timer_.cancel();
    }

   private:
    friend class HandshakeTurns;
    void unlink_if_waiting() {
      if (is_linked()) unlink();
    }

    HandshakeTurns& turns_;
    std::string network_;
    boost::asio::steady_timer timer_;
    bool has_come_ = false;
  };

  HandshakeTurns() = default;
  HandshakeTurns(const HandshakeTurns&) = delete;
  HandshakeTurns& operator=(const HandshakeTurns&) = delete;

 private:
  struct Line {
    std::size_t going = 0;
    boost::intrusive::list<Turn, boost::intrusive::constant_time_size<false>> waiting;
  };

  /// Passes a turn on to who has waited longest.
  void end(const std::string& network) {
    const auto found = lines_.find(network);
    auto& line = found->second;
    if (line.waiting.empty()) {
      if (--line.going == 0) lines_.erase(found);
      return;
    }
    auto& next = line.waiting.front();
    line.waiting.pop_front();
    next.has_come_ = true;
    next.timer_.cancel();
  }

  std::map<std::string, Line> lines_;
};

}  // namespace rrgate
