#include "core/discovery/service_refresh.hpp"

#include <algorithm>

#include "core/support/random.hpp"

namespace rr {

using std::chrono::milliseconds;

namespace {
constexpr std::chrono::seconds window{60};
constexpr milliseconds no_nonce_delay{15'000};
constexpr milliseconds announce_period{55'000};  // the reference waits for the next announcement in its place
constexpr std::size_t remembered = 16;           // of nonces; as many queries cover every step of the back-off
constexpr int attempts = 3;
}  // namespace

milliseconds service_query_delay(std::size_t recent, bool has_nonce) {
  auto delay = random_between(milliseconds(100), milliseconds(600));
  if (recent > 12)
    delay += random_between(milliseconds(25'000), milliseconds(35'000));
  else if (recent > 8)
    delay += random_between(milliseconds(9'000), milliseconds(11'000));
  else if (recent > 5)
    delay += random_between(milliseconds(4'500), milliseconds(5'500));
  else if (recent > 3)
    delay += random_between(milliseconds(2'000), milliseconds(2'500));
  return has_nonce ? delay : delay + no_nonce_delay;
}

void ServiceRefresh::handle_nonce(const std::string& nonce, TimePoint now) {
  const bool is_first = !was_announced_;
  was_announced_ = true;
  if (!is_first && nonce == nonce_) return;
  nonce_ = nonce;
  if (is_querying_) return;  // looked at when the query has ended
  if (std::find(fetched_.begin(), fetched_.end(), nonce) != fetched_.end()) return;
  failures_ = 0;
  // The first query does not wait for a nonce that never comes.
  if (is_first)
    due_ = now + service_query_delay(0, true);
  else
    schedule(now);
}

bool ServiceRefresh::take_due(TimePoint now) {
  if (!due_ || now < *due_) return false;
  due_.reset();
  is_querying_ = true;
  queried_nonce_ = nonce_;
  queries_.push_back(now);
  if (queries_.size() > remembered) queries_.pop_front();
  return true;
}

void ServiceRefresh::handle_success(TimePoint now) {
  is_querying_ = false;
  failures_ = 0;
  if (queried_nonce_.empty() && nonce_.empty()) {
    due_ = now + announce_period + no_nonce_delay;
    return;
  }
  fetched_.push_back(queried_nonce_);
  if (fetched_.size() > remembered) fetched_.pop_front();
  if (std::find(fetched_.begin(), fetched_.end(), nonce_) == fetched_.end()) schedule(now);
}

void ServiceRefresh::handle_failure(TimePoint now) {
  is_querying_ = false;
  if (++failures_ < attempts) {
    due_ = now + random_between(milliseconds(0), milliseconds(500));
    return;
  }
  failures_ = 0;
  due_ = now + announce_period + service_query_delay(0, true);
}

void ServiceRefresh::schedule(TimePoint now) {
  const auto recent = std::count_if(queries_.begin(), queries_.end(), [&](TimePoint at) { return at + window > now; });
  due_ = now + service_query_delay(static_cast<std::size_t>(recent), !nonce_.empty());
}

}  // namespace rr
