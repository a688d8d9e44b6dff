// When to ask a node for its services (again). Layer: discovery. Source: transports spec section 6.4, sessions spec
// section 2.16.
#pragma once

#include <chrono>
#include <deque>
#include <optional>
#include <string>

#include "core/support/time.hpp"

namespace rr {

/// Follows one node. Told of its nonce whenever that may have changed and of how each query ended; says when to query.
/// Queries follow a change after a random 0.1 to 0.6 s, later the more of them there were within a minute, so that a
/// node whose services come and go is not queried to death.
class ServiceRefresh {
 public:
  // --- told ---

  /// `nonce`  as announced; empty: the node has none, and is queried about once a minute.
  void handle_nonce(const std::string& nonce, TimePoint now);
  void handle_success(TimePoint now);
  /// Three attempts, then again after about a minute.
  void handle_failure(TimePoint now);

  // --- answers ---

  std::optional<TimePoint> poll_timeout() const { return due_; }
  /// Whether to query now; exactly one of the handle_success() and handle_failure() must follow.
  [[nodiscard]] bool take_due(TimePoint now);

 private:
  void schedule(TimePoint now);

  std::string nonce_;          ///< announced last
  std::string queried_nonce_;  ///< that of the query under way
  bool was_announced_ = false;
  bool is_querying_ = false;
  std::deque<std::string> fetched_;  ///< nonces of successful queries, newest last; late packets bring them up again
  std::deque<TimePoint> queries_;    ///< the latest ones
  int failures_ = 0;                 ///< in a row
  std::optional<TimePoint> due_;
};

/// How long to wait for a query before which there were `recent` others within a minute.
std::chrono::milliseconds service_query_delay(std::size_t recent, bool has_nonce);

}  // namespace rr
