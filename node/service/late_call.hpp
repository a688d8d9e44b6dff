// A request whose handler answers later. Layer: node.
#pragma once

#include <atomic>
#include <boost/asio/any_io_executor.hpp>
#include <boost/asio/cancellation_signal.hpp>
#include <functional>
#include <memory>

#include "core/support/error.hpp"
#include "core/types/value.hpp"
#include "node/driver/post_cancel.hpp"
#include "node/service/blocking_pool.hpp"
#include "node/service/caller.hpp"
#include "node/service/node_thread.hpp"

namespace rr {

/// Held by whatever works on the answer; where that forgets it, the client hears so. Who answers need not know whether
/// client, service and node are still there.
class LateCall {
 public:
  using Done = std::function<void(const Result<Value>& answer)>;

  /// `done`   gets the answer on the node's thread, unless the node is gone.
  /// `needed` lives until the answer: the objects that the handler uses.
  LateCall(std::shared_ptr<NodeThread> thread, boost::asio::any_io_executor executor, BlockingPool& pool, Caller caller,
           std::shared_ptr<const void> needed, Done done);
  LateCall(const LateCall&) = delete;
  LateCall& operator=(const LateCall&) = delete;
  ~LateCall();

  /// Any thread. The first answer counts. `used` is let go on the node's thread: what the handler works with.
  void answer(Result<Value> result, std::shared_ptr<const void> used = {});
  const Caller& caller() const { return caller_; }

  // For the node's thread.

  /// Runs `job`, which does not throw, on the pool; not at all where the client goes before it has begun.
  void run_blocking(std::function<void()> job) { pool_.run(caller_.id, std::move(job)); }
  const boost::asio::any_io_executor& executor() const { return executor_; }
  /// For the coroutine that answers.
  boost::asio::cancellation_slot cancellation_slot() { return cancelled_->slot(); }
  /// Nobody waits for the answer any more.
  void cancel() { post_cancel(executor_, cancelled_); }

 private:
  const std::shared_ptr<NodeThread> thread_;
  const boost::asio::any_io_executor executor_;
  BlockingPool& pool_;
  const Caller caller_;
  std::shared_ptr<const void> needed_;
  Done done_;
  std::atomic<bool> is_answered_ = false;
  const std::shared_ptr<boost::asio::cancellation_signal> cancelled_ =
      std::make_shared<boost::asio::cancellation_signal>();
};

}  // namespace rr
