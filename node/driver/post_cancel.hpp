// Ends a coroutine from anywhere on the loop's thread, also between two runs of the loop. Layer: driver.
#pragma once

#include <boost/asio/any_io_executor.hpp>
#include <boost/asio/cancellation_signal.hpp>
#include <boost/asio/post.hpp>
#include <memory>
#include <utility>

namespace rr {

/// Emits `signal`, whose slot a coroutine of `executor` has, when the loop runs next. Emitted outside the loop, what
/// co_spawn puts into the slot (Boost 1.81) queues a bare pointer to itself, and the signal may be gone when that runs.
inline void post_cancel(const boost::asio::any_io_executor& executor,
                        std::shared_ptr<boost::asio::cancellation_signal> signal) {
  boost::asio::post(executor, [signal = std::move(signal)] { signal->emit(boost::asio::cancellation_type::terminal); });
}

}  // namespace rr
