// Who may command which objects of one service, and until when. Layer: server/upstream.
//
// A lease is held by one client, for so long as it renews it. No sockets, no clocks, no device: what is to be done when
// a lease ends comes out of poll_event(). ServiceLocks drives it beside the locks.
#pragma once

#include <chrono>
#include <deque>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "server/config/config.hpp"
#include "server/upstream/lock_table.hpp"

namespace rrgate {

/// What a lease may be asked for. A page renews three times in this time, so that less is the network's to break.
inline constexpr milliseconds shortest_deadman{50};
inline constexpr milliseconds longest_deadman{60'000};

struct HeldLease {
  std::string path;  ///< canonical
  LockClient holder = 0;
  Subject by;  ///< as whom the holder has taken it
  milliseconds deadman{0};
  rr::TimePoint deadline;  ///< without another renewal
};

/// A lease is over: the device is to be made safe.
struct LeaseEnded {
  HeldLease lease;
  std::string why;
};

class LeaseTable {
 public:
  // --- asked. Errors   object_locked_error: another client has it; invalid_argument; invalid_operation: not held. ---

  /// Of an object and all below it. The holder asks anew for another dead-man's time. `takes_over`  from whoever has
  /// it.
  rr::Result<> acquire(LockClient client, const Subject& by, std::string_view path, milliseconds deadman,
                       bool takes_over, rr::TimePoint now);
  rr::Result<> renew(LockClient client, std::string_view path, rr::TimePoint now);
  /// Also of one that was lost: its former holder knows, and is a client like all others.
  rr::Result<> release(LockClient client, std::string_view path, rr::TimePoint now);
  /// Whether a client may write or call something of an object now. `client`  0: one who can hold nothing.
  rr::Result<> check(LockClient client, std::string_view path, LeaseNeed need, rr::TimePoint now);

  /// Whether a client has the lease of this object, or has lost it and not released it.
  bool has_at(LockClient client, std::string_view path) const;
  /// Whether anybody has a lease that covers the object.
  bool is_held(std::string_view path) const;

  // --- told ---

  void handle_gone(LockClient client);
  /// One lease: the session with the device has ended.
  void handle_lost(std::string_view path, const std::string& why);
  /// The gateway goes: no lease lasts.
  void handle_lost(const std::string& why);
  void handle_timeout(rr::TimePoint now);

  // --- answers, looked at ---

  std::optional<LeaseEnded> poll_event();
  rr::TimePoint poll_timeout() const;
  /// Whether nobody holds or has lost one.
  bool is_empty() const { return leases_.empty() && lost_.empty(); }
  std::vector<HeldLease> held() const;
  /// Errors   object_locked_error: a lease of another client covers the object, or something below it.
  rr::Result<> check_lock(LockClient client, std::string_view path, rr::TimePoint now);

 private:
  using Leases = std::map<std::string, HeldLease, std::less<>>;

  void end(Leases::iterator at, const std::string& why);
  /// Those that a client has, and has lost, without those of an object and above and below it.
  std::size_t count_besides(LockClient client, std::string_view key) const;
  rr::Error not_held(LockClient client, const std::string& key) const;
  /// Those of other clients at, above and below an object.
  std::vector<Leases::iterator> others_around(LockClient client, std::string_view key);

  Leases leases_;  ///< by canonical path; no two overlap
  /// What a client holds no more without having released it, and why. By canonical path.
  std::map<std::pair<LockClient, std::string>, std::string> lost_;
  std::deque<LeaseEnded> events_;
};

}  // namespace rrgate
