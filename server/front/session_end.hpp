// The end of a client's session, for the coroutine that serves it. Layer: server/front.
#pragma once

#include <boost/asio/as_tuple.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/asio/use_awaitable.hpp>

#include "node/transport/byte_stream.hpp"

namespace rrgate {

class SessionEnd {
 public:
  explicit SessionEnd(const boost::asio::any_io_executor& executor)
      : reached_(executor, boost::asio::steady_timer::time_point::max()) {}

  void reach() {
    is_reached_ = true;
    reached_.cancel();
  }
  rr::awaitable<void> wait() {
    while (!is_reached_) co_await reached_.async_wait(boost::asio::as_tuple(boost::asio::use_awaitable));
  }

 private:
  boost::asio::steady_timer reached_;
  bool is_reached_ = false;
};

}  // namespace rrgate
