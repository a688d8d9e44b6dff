#include "node/transport/watchdog.hpp"

namespace rr {

namespace asio = boost::asio;

asio::execution_context::id Watchdog::id;

Watchdog& Watchdog::of(const asio::any_io_executor& executor) {
  auto& watchdog = asio::use_service<Watchdog>(asio::query(executor, asio::execution::context));
  if (!watchdog.timer_) watchdog.timer_.emplace(executor);
  return watchdog;
}

void Watchdog::shutdown() {
  timer_.reset();
  armed_.clear();
}

Deadline::Deadline(const asio::any_io_executor& executor, std::function<void()> on_expired)
    : watchdog_(Watchdog::of(executor)), on_expired_(std::move(on_expired)) {}

void Deadline::arm(std::chrono::milliseconds after) {
  at_ = std::chrono::steady_clock::now() + after;
  if (!is_linked()) watchdog_.add(*this);
}

void Watchdog::add(Deadline& deadline) {
  armed_.push_back(deadline);
  if (!is_waiting_) wait();
}

void Watchdog::wait() {
  is_waiting_ = true;
  timer_->expires_after(tick);
  timer_->async_wait([this](const boost::system::error_code& error) {
    if (error) return;  // the watchdog is gone, or about to be
    is_waiting_ = false;
    check();
  });
}

void Watchdog::check() {
  const auto now = std::chrono::steady_clock::now();
  List expired;
  for (auto it = armed_.begin(); it != armed_.end();) {
    auto& deadline = *it++;
    if (deadline.at_ > now) continue;
    deadline.unlink();
    expired.push_back(deadline);
  }
  // One at a time: a callback may destroy or disarm others of this list.
  while (!expired.empty()) {
    auto& deadline = expired.front();
    deadline.unlink();
    const auto call = deadline.on_expired_;
    call();
  }
  if (!armed_.empty() && !is_waiting_) wait();
}

}  // namespace rr
