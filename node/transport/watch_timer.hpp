// When a watch looks again: shortly after it has heard of news, and from time to time. Layer: node/transport.
#pragma once

#include <boost/asio/any_io_executor.hpp>
#include <boost/asio/steady_timer.hpp>
#include <chrono>
#include <utility>

#include "node/transport/await_tuple.hpp"
#include "node/transport/byte_stream.hpp"

namespace rr {

/// For the executor's thread, in the state of a watch that its coroutines share.
class WatchTimer {
 public:
  /// `after_news`  from the first news until the next look: news come in swarms.
  WatchTimer(const boost::asio::any_io_executor& executor, std::chrono::milliseconds refresh,
             std::chrono::milliseconds after_news)
      : refresh_(refresh), after_news_(after_news), wake_(executor) {}

  void stop() {
    is_stopped_ = true;
    wake_.cancel();
  }
  bool is_stopped() const { return is_stopped_; }
  /// What is heard of from here on is for another look.
  void begin_look() { has_news_ = false; }
  void hear_news() {
    if (!std::exchange(has_news_, true)) wake_.cancel();
  }
  /// Until it is time for the next look, or stop().
  awaitable<void> wait() {
    if (!has_news_ && !is_stopped_) {
      wake_.expires_after(refresh_);
      co_await wake_.async_wait(await_tuple);
    }
    if (!has_news_ || is_stopped_) co_return;
    wake_.expires_after(after_news_);
    co_await wake_.async_wait(await_tuple);
  }

 private:
  const std::chrono::milliseconds refresh_;
  const std::chrono::milliseconds after_news_;
  boost::asio::steady_timer wake_;
  bool has_news_ = false;
  bool is_stopped_ = false;
};

}  // namespace rr
