// Several ways to one end, tried side by side. Layer: node/transport. Source: transports spec section 1.3.
#pragma once

#include <boost/asio/as_tuple.hpp>
#include <boost/asio/bind_cancellation_slot.hpp>
#include <boost/asio/cancellation_signal.hpp>
#include <boost/asio/co_spawn.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/asio/this_coro.hpp>
#include <boost/asio/use_awaitable.hpp>
#include <chrono>
#include <exception>
#include <functional>
#include <list>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "core/support/error.hpp"
#include "node/transport/byte_stream.hpp"

namespace rr {

/// Between URLs of one node.
inline constexpr std::chrono::milliseconds candidate_stagger{15};

/// One way. It ends by itself.
template <class T>
struct Runner {
  std::string name;  ///< "rr+tcp://10.0.0.1:52222", for the reasons of failures
  std::function<awaitable<Result<T>>()> run;
};

/// Shared by the attempts, since they end a little after the race.
template <class T>
struct Race {
  explicit Race(const boost::asio::any_io_executor& executor) : changed(executor) {}

  boost::asio::steady_timer changed;                     ///< cancelled when an attempt ends
  std::list<boost::asio::cancellation_signal> attempts;  ///< those that have ended, too
  std::optional<T> winner;
  std::vector<std::pair<std::string, Error>> failures;
};

/// Cancels the attempts when the race is over, also when it is given up.
template <class T>
class RaceGuard {
 public:
  explicit RaceGuard(std::shared_ptr<Race<T>> race) : race_(std::move(race)) {}
  RaceGuard(const RaceGuard&) = delete;
  RaceGuard& operator=(const RaceGuard&) = delete;
  ~RaceGuard() {
    for (auto& attempt : race_->attempts) attempt.emit(boost::asio::cancellation_type::terminal);
  }

 private:
  std::shared_ptr<Race<T>> race_;
};

template <class T>
awaitable<void> run_attempt(std::shared_ptr<Race<T>> race, Runner<T> runner) {
  auto result = co_await runner.run();
  if (!result)
    race->failures.emplace_back(std::move(runner.name), result.error());
  else if (!race->winner)
    race->winner.emplace(std::move(*result));  // one that comes too late goes, with what it has opened
  race->changed.cancel();
}

/// What a race came to in which nobody arrived: all reasons; the code of the most telling one.
inline Error join_failures(const std::vector<std::pair<std::string, Error>>& failures, const Error& otherwise) {
  if (failures.empty()) return otherwise;
  Error all = failures.back().second;
  for (const auto code : {ErrorCode::authentication_error, ErrorCode::node_not_found})
    for (const auto& [name, error] : failures)
      if (error.code == code) all = error;
  if (failures.size() == 1) return all;
  all.message = "none of " + std::to_string(failures.size()) + " ways works";
  for (const auto& [name, error] : failures) all.message += "; " + name + ": " + error.message;
  return all;
}

/// Starts the runners `stagger` apart, the next one at once where one fails; the first to arrive wins and the others
/// are cancelled. Can be cancelled itself, and leaves nothing behind.
/// Errors   join_failures() of them; `otherwise` where there are none.
/// Throws   boost::system::system_error: it was cancelled.
template <class T>
awaitable<Result<T>> race(std::vector<Runner<T>> runners, std::chrono::milliseconds stagger, Error otherwise) {
  namespace asio = boost::asio;
  const auto executor = co_await asio::this_coro::executor;
  const auto state = std::make_shared<Race<T>>(executor);
  const RaceGuard<T> guard(state);
  std::size_t started = 0;
  while (!state->winner && state->failures.size() < runners.size()) {
    if (started < runners.size()) {
      const auto failed = state->failures.size();
      auto attempt = run_attempt(state, std::move(runners[started]));
      ++started;
      auto& signal = state->attempts.emplace_back();
      // A coroutine uses its slot until its completion handler is called, even one that never waits: that keeps it.
      const auto keep = [state](const std::exception_ptr& thrown) {
        if (!thrown) return;
        state->failures.emplace_back("", make_error(ErrorCode::internal_error, "it can't be tried"));
        state->changed.cancel();
      };
      asio::co_spawn(executor, std::move(attempt), asio::bind_cancellation_slot(signal.slot(), keep));
      if (state->winner || state->failures.size() != failed) continue;  // it had nothing to wait for
    }
    if (started < runners.size())
      state->changed.expires_after(stagger);
    else
      state->changed.expires_at(std::chrono::steady_clock::time_point::max());  // each ends in its own time
    co_await state->changed.async_wait(asio::as_tuple(asio::use_awaitable));
  }
  if (!state->winner) co_return join_failures(state->failures, otherwise);
  co_return std::move(*state->winner);
}

}  // namespace rr
