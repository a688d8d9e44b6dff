// Threads for handlers that block. Layer: node.
#pragma once

#include <condition_variable>
#include <cstdint>
#include <deque>
#include <functional>
#include <mutex>
#include <thread>
#include <vector>

namespace rr {

/// Runs jobs side by side, each on a thread of its own up to `max_threads`; more wait their turn. Threads start when
/// they are needed first, and stay.
class BlockingPool {
 public:
  using Owner = std::uint64_t;

  explicit BlockingPool(std::size_t max_threads) : max_threads_(max_threads) {}
  BlockingPool(const BlockingPool&) = delete;
  BlockingPool& operator=(const BlockingPool&) = delete;
  ~BlockingPool() { stop(); }

  /// `job` does not throw. Throws std::system_error: there is no thread, and none can be started.
  void run(Owner owner, std::function<void()> job);
  /// Forgets the owner's jobs that have not begun.
  void drop(Owner owner);
  /// Forgets all jobs that have not begun and waits for those that have.
  void stop();

 private:
  struct Job {
    Owner owner;
    std::function<void()> work;
  };
  void work();

  const std::size_t max_threads_;
  std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<Job> waiting_;
  std::size_t idle_ = 0;
  bool is_stopped_ = false;
  std::vector<std::thread> threads_;  ///< for the owner of the pool alone
};

}  // namespace rr
