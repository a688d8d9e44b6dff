// Monitors of a service: who is in one, who waits for it, and for how long. Layer: server/upstream.
// Source: sessions spec section 2.7.
#include <algorithm>

#include "server/upstream/lock_path.hpp"
#include "server/upstream/lock_table.hpp"

namespace rrgate {

namespace {

constexpr std::size_t max_monitors = 1024;
constexpr std::size_t max_waiting = 1024;  ///< for one monitor
/// The device forgets a monitor whose owner was idle for 30 s. A little earlier here: an owner that is refused in vain
/// is better than two that are not.
constexpr std::chrono::seconds idle_timeout{25};

rr::Error invalid(std::string why) {
  return {rr::ErrorCode::invalid_operation, std::move(why)};
}

rr::Error too_late() {
  return {rr::ErrorCode::operation_timeout, "the monitor lock was not free in time"};
}

rr::Error already_entering() {
  return invalid("Already acquiring or acquired monitor lock");
}

}  // namespace

rr::Result<> LockTable::check_monitor(LockClient client, const std::string& key, rr::TimePoint now) {
  const auto found = monitors_.find(key);
  if (found != monitors_.end()) {
    auto& monitor = found->second;
    if (monitor.owner != 0 && monitor.asking == Asking::nothing && now >= monitor.idle_deadline) handle_timeout(now);
    if (monitor.owner != 0 && monitor.owner != client)
      return invalid("Object is currently monitor locked. Use MonitorEnter to obtain monitor lock");
    if (monitor.owner == client) monitor.idle_deadline = now + idle_timeout;
  }
  if (const auto lost = lost_monitors_.find({client, key}); lost != lost_monitors_.end())
    return invalid("the monitor lock of " + rr::quote(key) + " is not this client's any more: " + lost->second +
                   "; exit it, or enter it again");
  return {};
}

void LockTable::enter(LockClient client, const rr::LockWanted& wanted, rr::TimePoint now) {
  const auto key = canonical_lock_path(wanted.path);
  handle_timeout(now);
  const auto never = rr::TimePoint::max();
  const Waiting waiting{client, wanted.id, wanted.path, wanted.timeout.count() < 0 ? never : now + wanted.timeout};
  const auto found = monitors_.find(key);
  if (found == monitors_.end()) {
    if (monitors_.size() >= max_monitors)
      return answer(client, wanted.id,
                    rr::make_error(rr::ErrorCode::out_of_system_resource, "too many objects are monitor locked"));
    lost_monitors_.erase({client, key});
    return begin_entering(monitors_[key], waiting, now);
  }
  auto& monitor = found->second;
  const bool is_waiting = std::any_of(monitor.queue.begin(), monitor.queue.end(),
                                      [client](const Waiting& other) { return other.client == client; });
  if (monitor.owner == client || is_waiting) return answer(client, wanted.id, already_entering());
  lost_monitors_.erase({client, key});
  if (wanted.timeout.count() == 0) return answer(client, wanted.id, too_late());
  if (monitor.queue.size() >= max_waiting)
    return answer(client, wanted.id,
                  rr::make_error(rr::ErrorCode::out_of_system_resource, "too many clients wait for this monitor lock"));
  monitor.queue.push_back(waiting);
}

void LockTable::begin_entering(Monitor& monitor, const Waiting& waiting, rr::TimePoint now) {
  const auto& party = parties_.at(waiting.client);
  monitor.owner = monitor.asker = waiting.client;
  monitor.session = party.session;
  monitor.by = party.user;
  monitor.path = waiting.path;
  monitor.request = waiting.request;
  const auto left = waiting.deadline == rr::TimePoint::max()
                        ? std::chrono::milliseconds(-1)
                        : std::chrono::ceil<std::chrono::milliseconds>(waiting.deadline - now);
  ask(monitor, Asking::take, party.session, rr::LockCommand::enter_monitor, left);
}

void LockTable::exit(LockClient client, const rr::LockWanted& wanted, rr::TimePoint now) {
  const auto key = canonical_lock_path(wanted.path);
  handle_timeout(now);
  if (lost_monitors_.erase({client, key}) > 0) return answer(client, wanted.id, {});
  const auto found = monitors_.find(key);
  if (found == monitors_.end()) return answer(client, wanted.id, {});
  auto& monitor = found->second;
  const auto is_his = [client](const Waiting& waiting) { return waiting.client == client; };
  if (const auto waiting = std::find_if(monitor.queue.begin(), monitor.queue.end(), is_his);
      waiting != monitor.queue.end()) {
    answer(client, waiting->request, invalid("Not acquiring monitor lock"));
    monitor.queue.erase(waiting);
  }
  if (monitor.owner != client || monitor.asking != Asking::nothing) {
    answer(client, wanted.id, invalid("Not monitor locked"));
    if (monitor.owner == client && monitor.asking == Asking::take) {
      answer(client, monitor.request, invalid("Not acquiring monitor lock"));
      take_back_monitor(monitor, 0);
    }
    return;
  }
  monitor.asker = client;
  monitor.request = wanted.id;
  ask(monitor, Asking::give_back, monitor.session, wanted.command);
}

/// From one who is gone, or has had enough.
void LockTable::take_back_monitor(Monitor& monitor, LockClient leaver) {
  monitor.owner = monitor.asker = 0;
  monitor.leaver = leaver;
  if (monitor.asking == Asking::nothing)
    ask(monitor, Asking::give_back, monitor.session, rr::LockCommand::exit_monitor);
}

void LockTable::lose_monitor(Monitor& monitor, const std::string& why) {
  if (monitor.owner != 0) lost_monitors_[{monitor.owner, canonical_lock_path(monitor.path)}] = why;
  monitor.owner = 0;
}

void LockTable::hand_on(Monitors::iterator at, rr::TimePoint now) {
  auto& queue = at->second.queue;
  while (!queue.empty()) {
    const auto next = std::move(queue.front());
    queue.pop_front();
    if (now < next.deadline) return begin_entering(at->second, next, now);
    answer(next.client, next.request, too_late());
  }
  monitors_.erase(at);
}

void LockTable::monitor_answered(Monitors::iterator at, const rr::Result<>& result, rr::TimePoint now) {
  auto& monitor = at->second;
  const auto was = std::exchange(monitor.asking, Asking::nothing);
  const auto asker = std::exchange(monitor.asker, 0);
  answer(asker, monitor.request, result);
  if (was == Asking::take && result && monitor.owner != 0) {
    monitor.idle_deadline = now + idle_timeout;
    return;
  }
  if (was == Asking::take && (result || is_unknown(result))) return take_back_monitor(monitor, monitor.leaver);
  if (is_unknown(result)) events_.push_back(LockSessionInDoubt{monitor.session});
  const auto leaver = std::exchange(monitor.leaver, 0);
  monitor.owner = 0;
  hand_on(at, now);
  end_leaving(leaver);
}

/// Owners that do nothing lose their monitor; who waits is told that it is too late.
void LockTable::handle_timeout(rr::TimePoint now) {
  for (auto& [key, monitor] : monitors_) {
    std::erase_if(monitor.queue, [&](const Waiting& waiting) {
      const bool is_late = waiting.deadline <= now;
      if (is_late) answer(waiting.client, waiting.request, too_late());
      return is_late;
    });
    if (monitor.owner == 0 || monitor.asking != Asking::nothing || now < monitor.idle_deadline) continue;
    lose_monitor(monitor, "its owner was idle");
    take_back_monitor(monitor, 0);
  }
}

rr::TimePoint LockTable::poll_timeout() const {
  auto next = rr::TimePoint::max();
  for (const auto& [key, monitor] : monitors_) {
    for (const auto& waiting : monitor.queue) next = std::min(next, waiting.deadline);
    if (monitor.owner != 0 && monitor.asking == Asking::nothing) next = std::min(next, monitor.idle_deadline);
  }
  return next;
}

}  // namespace rrgate
