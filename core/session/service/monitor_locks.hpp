// Monitor locks of one service's objects: one session at a time, others queue. Layer: session.
// Source: sessions spec section 2.6.
#pragma once

#include <chrono>
#include <deque>
#include <map>
#include <memory>

#include "core/session/service/object_locks.hpp"

namespace rr {

class ServiceObject;

/// Who is in which object's monitor and who waits for it, first come, first served. Time is a parameter: an owner that
/// does nothing with the object for 30 s has lost it, which is found out when somebody looks. Monitors keep no objects:
/// that of one that has gone is never found again, and makes room.
class MonitorLocks {
 public:
  enum class State : std::uint8_t { owned, waiting };

  /// `timeout` negative: no limit.
  /// Errors   invalid_operation: this session owns it or waits already; operation_timeout: not free, and `timeout` is
  /// 0;
  ///          out_of_system_resource.
  Result<State> enter(const std::shared_ptr<ServiceObject>& object, SessionId session,
                      std::chrono::milliseconds timeout, Now now);
  /// How the session's wait stands.
  /// Errors   invalid_operation: it does not wait; operation_timeout, which ends the wait.
  Result<State> look(const ServiceObject& object, SessionId session, Now now);
  /// Also ends a wait, which is an error all the same.
  /// Returns  whether the object was ever locked (a client that leaves another object does no harm).
  /// Errors   invalid_operation: not the owner.
  Result<bool> exit(const ServiceObject& object, SessionId session, Now now);
  /// Whether the session may use the object; keeps an owner's lock alive.
  /// Errors   invalid_operation.
  Result<> check(const ServiceObject& object, SessionId session, Now now);
  /// When look() may answer something else without anybody doing anything.
  TimePoint next_change(const ServiceObject& object, SessionId session) const;

  /// Gives back what the session owns and ends its waits.
  void remove_session(SessionId session);
  bool empty() const { return monitors_.empty(); }
  bool has_waiting() const;

 private:
  struct Waiting {
    SessionId session = 0;
    TimePoint deadline;
  };
  struct Monitor {
    std::weak_ptr<ServiceObject> object;  ///< once it has gone, its address, the key, may be that of another
    SessionId owner = 0;
    TimePoint idle_deadline = {};
    std::deque<Waiting> queue = {};
  };
  static constexpr std::chrono::seconds idle_timeout{30};
  static constexpr std::size_t max_monitors = 1024;
  static constexpr std::size_t max_waiting = 1024;

  Monitor* find(const ServiceObject& object, Now now);
  static void hand_on(Monitor& monitor, Now now);

  std::map<const ServiceObject*, Monitor> monitors_;
};

}  // namespace rr
