// What a device answers to what makes it safe, for those who wait for that a short time. Layer: server/access.
#pragma once

#include <boost/asio/as_tuple.hpp>
#include <boost/asio/awaitable.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/asio/use_awaitable.hpp>
#include <chrono>
#include <memory>
#include <optional>
#include <string>

#include "core/support/error.hpp"

namespace rrgate {

/// Of all safe values of an object that are sent at once. For one thread.
class SafeAnswer {
 public:
  /// From when it is made on; what is answered later is heard by nobody.
  static constexpr std::chrono::seconds longest_wait{2};

  SafeAnswer(const boost::asio::any_io_executor& executor, std::string device, std::string path)
      : device_(std::move(device)), path_(std::move(path)), end_(executor, longest_wait) {}

  const std::string& device() const { return device_; }
  const std::string& path() const { return path_; }
  /// Nothing: the device has not answered yet.
  const std::optional<rr::Result<>>& result() const { return result_; }

  void set(const rr::Result<>& result) {
    result_ = result;
    end_.cancel();
  }
  /// Until it is there, or is not to be waited for any longer. Whoever waits keeps this.
  boost::asio::awaitable<void> wait() {
    if (!result_) (void)co_await end_.async_wait(boost::asio::as_tuple(boost::asio::use_awaitable));
  }

 private:
  std::string device_;
  std::string path_;
  std::optional<rr::Result<>> result_;
  boost::asio::steady_timer end_;
};
using SafeAnswerPtr = std::shared_ptr<SafeAnswer>;

}  // namespace rrgate
