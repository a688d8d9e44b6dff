#include "node/service/blocking_pool.hpp"

#include <algorithm>
#include <iterator>
#include <system_error>
#include <utility>

namespace rr {

void BlockingPool::run(Owner owner, std::function<void()> job) {
  const std::lock_guard lock(mutex_);
  if (is_stopped_) return;
  if (idle_ <= waiting_.size() && threads_.size() < max_threads_) {
    try {
      threads_.emplace_back([this] { work(); });
    } catch (const std::system_error&) {
      if (threads_.empty()) throw;  // those that there are do it in their time
    }
  }
  waiting_.push_back({owner, std::move(job)});
  changed_.notify_one();
}

void BlockingPool::drop(Owner owner) {
  std::deque<Job> dropped;  // destroyed without the lock: what they hold may do anything
  const std::lock_guard lock(mutex_);
  const auto kept =
      std::stable_partition(waiting_.begin(), waiting_.end(), [&](const Job& job) { return job.owner != owner; });
  std::move(kept, waiting_.end(), std::back_inserter(dropped));
  waiting_.erase(kept, waiting_.end());
}

void BlockingPool::stop() {
  std::deque<Job> dropped;
  {
    const std::lock_guard lock(mutex_);
    is_stopped_ = true;
    dropped.swap(waiting_);
  }
  changed_.notify_all();
  for (auto& thread : threads_) thread.join();
  threads_.clear();
}

void BlockingPool::work() {
  std::unique_lock lock(mutex_);
  while (true) {
    ++idle_;
    changed_.wait(lock, [this] { return is_stopped_ || !waiting_.empty(); });
    --idle_;
    if (is_stopped_) return;
    auto job = std::move(waiting_.front().work);
    waiting_.pop_front();
    lock.unlock();
    job();
    job = nullptr;
    lock.lock();
  }
}

}  // namespace rr
