#include "core/session/service/monitor_locks.hpp"

#include <algorithm>

namespace rr {

namespace {

Error invalid(std::string why) {
  return {ErrorCode::invalid_operation, std::move(why)};
}

Error too_late() {
  return {ErrorCode::operation_timeout, "the monitor lock was not free in time"};
}

}  // namespace

/// Takes the lock from an owner that is idle, and gives a free one to the first that waits and still wants it.
void MonitorLocks::hand_on(Monitor& monitor, Now now) {
  if (monitor.owner != 0 && now.steady >= monitor.idle_deadline) monitor.owner = 0;
  if (monitor.owner != 0) return;
  const auto next = std::find_if(monitor.queue.begin(), monitor.queue.end(),
                                 [&](const Waiting& waiting) { return now.steady < waiting.deadline; });
  if (next == monitor.queue.end()) return;
  monitor.owner = next->session;
  monitor.idle_deadline = now.steady + idle_timeout;
  monitor.queue.erase(next);
}

MonitorLocks::Monitor* MonitorLocks::find(const ServiceObject& object, Now now) {
  const auto found = monitors_.find(&object);
  if (found == monitors_.end() || found->second.object.expired()) return nullptr;
  hand_on(found->second, now);
  return &found->second;
}

Result<MonitorLocks::State> MonitorLocks::enter(const std::shared_ptr<ServiceObject>& object, SessionId session,
                                                std::chrono::milliseconds timeout, Now now) {
  auto* known = find(*object, now);
  if (!known) {
    if (monitors_.size() >= max_monitors)
      std::erase_if(monitors_, [](const auto& item) {
        const auto& [address, each] = item;
        return each.object.expired() || (each.owner == 0 && each.queue.empty());
      });
    if (monitors_.size() >= max_monitors)
      return make_error(ErrorCode::out_of_system_resource, "too many objects are monitor locked");
    known = &monitors_.insert_or_assign(object.get(), Monitor{object}).first->second;
  }
  auto& monitor = *known;
  const bool is_waiting = std::any_of(monitor.queue.begin(), monitor.queue.end(),
                                      [&](const Waiting& waiting) { return waiting.session == session; });
  if (monitor.owner == session || is_waiting) return invalid("Already acquiring or acquired monitor lock");
  if (monitor.owner == 0) {
    monitor.owner = session;
    monitor.idle_deadline = now.steady + idle_timeout;
    return State::owned;
  }
  if (timeout.count() == 0) return too_late();
  if (monitor.queue.size() >= max_waiting)
    return make_error(ErrorCode::out_of_system_resource, "too many clients wait for this monitor lock");
  monitor.queue.push_back({session, timeout.count() < 0 ? TimePoint::max() : now.steady + timeout});
  return State::waiting;
}

Result<MonitorLocks::State> MonitorLocks::look(const ServiceObject& object, SessionId session, Now now) {
  auto* monitor = find(object, now);
  if (!monitor) return invalid("Not acquiring monitor lock");
  if (monitor->owner == session) return State::owned;
  const auto mine = std::find_if(monitor->queue.begin(), monitor->queue.end(),
                                 [&](const Waiting& waiting) { return waiting.session == session; });
  if (mine == monitor->queue.end()) return invalid("Not acquiring monitor lock");
  if (now.steady < mine->deadline) return State::waiting;
  monitor->queue.erase(mine);
  return too_late();
}

Result<bool> MonitorLocks::exit(const ServiceObject& object, SessionId session, Now now) {
  auto* monitor = find(object, now);
  if (!monitor) return false;
  std::erase_if(monitor->queue, [&](const Waiting& waiting) { return waiting.session == session; });
  if (monitor->owner != session) return invalid("Not monitor locked");
  monitor->owner = 0;
  return true;
}

Result<> MonitorLocks::check(const ServiceObject& object, SessionId session, Now now) {
  auto* monitor = find(object, now);
  if (!monitor || monitor->owner == 0) return {};
  if (monitor->owner != session)
    return invalid("Object is currently monitor locked. Use MonitorEnter to obtain monitor lock");
  monitor->idle_deadline = now.steady + idle_timeout;
  return {};
}

TimePoint MonitorLocks::next_change(const ServiceObject& object, SessionId session) const {
  const auto found = monitors_.find(&object);
  if (found == monitors_.end()) return TimePoint::min();
  const auto& monitor = found->second;
  if (monitor.owner == 0 || monitor.owner == session) return TimePoint::min();
  const auto mine = std::find_if(monitor.queue.begin(), monitor.queue.end(),
                                 [&](const Waiting& waiting) { return waiting.session == session; });
  return mine == monitor.queue.end() ? TimePoint::min() : std::min(mine->deadline, monitor.idle_deadline);
}

void MonitorLocks::remove_session(SessionId session) {
  for (auto& [object, monitor] : monitors_) {
    if (monitor.owner == session) monitor.owner = 0;
    std::erase_if(monitor.queue, [&](const Waiting& waiting) { return waiting.session == session; });
  }
}

bool MonitorLocks::has_waiting() const {
  return std::any_of(monitors_.begin(), monitors_.end(), [](const auto& item) { return !item.second.queue.empty(); });
}

}  // namespace rr
