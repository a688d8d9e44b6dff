// Operations that wait for something that happens some time, or never. Layer: node/client.
#pragma once

#include <boost/asio/associated_cancellation_slot.hpp>
#include <boost/asio/steady_timer.hpp>
#include <chrono>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <utility>

#include "node/client/async_object.hpp"
#include "node/driver/clocks.hpp"

namespace rr::detail {

/// Who waits for a T. For one thread; its owner lives in a shared_ptr, since completions may let go of it.
template <class T>
class Waiters {
 public:
  using Done = std::function<void(Result<T>)>;
  using Id = std::uint64_t;

  explicit Waiters(boost::asio::io_context& io) : io_(io) {}

  /// `done` gets what complete() brings, request_timeout after `timeout`, or what cancel() says.
  Id add(Done done, std::optional<std::chrono::milliseconds> timeout, const std::shared_ptr<void>& owner) {
    const Id id = ++last_id_;
    auto& waiter = waiters_.emplace(id, Waiter{std::move(done), nullptr}).first->second;
    if (!timeout) return id;
    waiter.timer = std::make_unique<boost::asio::steady_timer>(io_, bounded(*timeout));
    waiter.timer->async_wait([this, id, timeout, weak = std::weak_ptr(owner)](const boost::system::error_code& error) {
      const auto keep = weak.lock();
      if (error || !keep) return;
      cancel(id, make_error(ErrorCode::request_timeout, "nothing within " + std::to_string(timeout->count()) + " ms"));
    });
    return id;
  }
  void cancel(Id id, Error why) {
    if (auto found = waiters_.extract(id)) found.mapped().done(std::move(why));
  }
  /// The one that has waited longest.
  void complete_first(Result<T> result) {
    auto first = waiters_.extract(waiters_.begin());
    first.mapped().done(std::move(result));
  }
  void complete_all(const Result<T>& result) {
    for (auto& [id, waiter] : std::exchange(waiters_, {})) waiter.done(result);
  }
  bool is_empty() const { return waiters_.empty(); }

 private:
  struct Waiter {
    Done done;
    std::unique_ptr<boost::asio::steady_timer> timer;  ///< null: waits for ever
  };

  boost::asio::io_context& io_;
  std::map<Id, Waiter> waiters_;
  Id last_id_ = 0;
};

/// Begins an operation that `waiters`, part of `owner`, completes. Its cancellation slot works.
template <class T, class Owner, class Token, class Begin>
auto wait_in(std::shared_ptr<Owner> owner, Waiters<T>& waiters, boost::asio::any_io_executor executor, Token& token,
             Begin begin) {
  return boost::asio::async_initiate<Token, void(std::exception_ptr, T)>(
      [owner = std::move(owner), &waiters, executor, begin](auto handler) {
        auto slot = boost::asio::get_associated_cancellation_slot(handler);
        const CompleteOnce<T, decltype(handler)> complete(std::move(handler), executor);
        const auto id = begin(*owner, complete);
        if (!id || !slot.is_connected()) return;
        slot.assign([weak = std::weak_ptr(owner), &waiters, id = *id](boost::asio::cancellation_type) {
          if (const auto keep = weak.lock())
            waiters.cancel(id, make_error(ErrorCode::operation_cancelled, "was cancelled"));
        });
      },
      token);
}

}  // namespace rr::detail
