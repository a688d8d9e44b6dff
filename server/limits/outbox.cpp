#include "server/limits/outbox.hpp"

#include <utility>

namespace rrgate {

namespace {

/// What may wait for a slow reader before it is told and closed; one message alone may be larger.
constexpr std::size_t max_outbox_bytes = 4u * 1024 * 1024;
constexpr std::size_t max_waiting_messages = 100'000;
/// About as much goes out in one write.
constexpr std::size_t write_bytes = 64u * 1024;

}  // namespace

Outbox::Token Outbox::begin() {
  opened_[++last_token_] = waiting_.end();
  return last_token_;
}

void Outbox::forget(Token of) {
  drop_newest(of);
  opened_.erase(of);
  count();
}

void Outbox::add(std::string text) {
  if (is_closed_) return;
  const auto bytes = bytes_ + text.size();
  const bool is_full = bytes > max_outbox_bytes || waiting_.size() >= max_waiting_messages ||
                       !memory_.resize(in_flight_ + kept_bytes_ + bytes);
  if (is_full && !waiting_.empty()) {
    clear();
    has_overflown_ = is_closed_ = true;
    text = std::move(too_slow_);
  }
  bytes_ += text.size();
  count();
  waiting_.push_back({std::move(text), 0, 0, nullptr});
  news_.cancel();
}

void Outbox::add(Token of, std::string text) {
  if (!opened_.contains(of)) return;
  drop_newest(of);
  add(std::move(text));
}

void Outbox::add_newest(Token of, std::size_t bytes, std::function<std::string()> text) {
  const auto opened = opened_.find(of);
  if (is_closed_ || opened == opened_.end()) return;
  auto& at = opened->second;
  const bool is_new = at == waiting_.end();
  if (is_new) at = waiting_.insert(waiting_.end(), Entry{{}, of, 0, nullptr});
  kept_bytes_ += bytes - std::exchange(at->kept_bytes, bytes);
  at->newest = std::move(text);
  count();
  if (is_new) news_.cancel();
}

void Outbox::drop_newest(Token of) {
  const auto opened = opened_.find(of);
  if (opened == opened_.end() || opened->second == waiting_.end()) return;
  kept_bytes_ -= opened->second->kept_bytes;
  waiting_.erase(std::exchange(opened->second, waiting_.end()));
}

void Outbox::clear() {
  for (auto& [token, at] : opened_) at = waiting_.end();
  waiting_.clear();
  bytes_ = kept_bytes_ = 0;
}

/// In any case: it is there already.
void Outbox::count() {
  memory_.hold(in_flight_ + kept_bytes_ + bytes_);
}

void Outbox::close() {
  is_closed_ = true;
  clear();
  count();
  news_.cancel();
}

std::vector<std::string> Outbox::take() {
  std::vector<std::string> out;
  std::size_t taken = 0;
  while (!waiting_.empty() && taken < write_bytes) {
    auto entry = std::move(waiting_.front());
    waiting_.pop_front();
    if (entry.of != 0) {
      opened_[entry.of] = waiting_.end();
      kept_bytes_ -= entry.kept_bytes;
      out.push_back(entry.newest());
    } else {
      bytes_ -= entry.text.size();
      out.push_back(std::move(entry.text));
    }
    taken += out.back().size();
  }
  in_flight_ = taken;
  count();
  return out;
}

void Outbox::note_sent() {
  in_flight_ = 0;
  count();
}

}  // namespace rrgate
