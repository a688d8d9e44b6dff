#include "server/upstream/lock_table.hpp"

#include <algorithm>

#include "core/session/service_path.hpp"
#include "server/upstream/lock_path.hpp"

namespace rrgate {

namespace {

constexpr std::size_t max_locks = 1024;

rr::Error locked(std::string why) {
  return {rr::ErrorCode::object_locked_error, std::move(why)};
}

std::string name_of_holder(const Subject& by) {
  return by.is_nobody() ? "another client" : by.name;
}

}  // namespace

// --- clients ---

void LockTable::add(LockClient client, LockParty party) {
  parties_.insert_or_assign(client, std::move(party));
}

void LockTable::remove(LockClient client, rr::TimePoint now) {
  const auto left = parties_.extract(client);
  if (!left) return;
  const auto& party = left.mapped();
  // Whom the device lets use a lock of this one's session: clients of that, or those who lock there as the same user.
  const auto of_user = std::find_if(parties_.begin(), parties_.end(), [&](const auto& other) {
    if (party.user.is_nobody() || other.second.user != party.user) return false;
    return party.has_own_session ? other.second.has_own_session : other.second.session == party.session;
  });
  for (auto it = locks_.begin(); it != locks_.end();) {
    const auto at = it++;
    auto& lock = at->second;
    if (lock.owner != client) continue;
    if (!lock.user.is_nobody() && of_user != parties_.end()) {  // the lock of a user lasts as long as one client of his
      lock.owner = of_user->first;
      lock.session = of_user->second.session;
    } else if (party.has_own_session && lock.asking == Asking::nothing) {  // ends with that
      locks_.erase(at);
    } else {
      take_back_lock(lock, client);
    }
  }
  for (auto it = monitors_.begin(); it != monitors_.end();) {
    const auto at = it++;
    auto& monitor = at->second;
    std::erase_if(monitor.queue, [&](const Waiting& waiting) { return waiting.client == client; });
    if (monitor.owner != client) continue;
    if (party.has_own_session && monitor.asking == Asking::nothing) {
      hand_on(at, now);
    } else {
      take_back_monitor(monitor, client);
    }
  }
  const auto is_his = [client](const auto& lost) { return lost.first.first == client; };
  std::erase_if(lost_locks_, is_his);
  std::erase_if(lost_monitors_, is_his);
  end_leaving(client);
}

void LockTable::end_leaving(LockClient leaver) {
  if (leaver == 0) return;
  const auto waits = [leaver](const auto& item) { return item.second.leaver == leaver; };
  if (std::any_of(locks_.begin(), locks_.end(), waits) || std::any_of(monitors_.begin(), monitors_.end(), waits))
    return;
  events_.push_back(LockClientLeft{leaver});
}

void LockTable::handle_wanted(LockClient client, const rr::LockWanted& wanted, rr::TimePoint now) {
  if (!parties_.contains(client)) return;
  switch (wanted.command) {
    case rr::LockCommand::lock_for_user:
    case rr::LockCommand::lock_for_client:
      return lock(client, wanted);
    case rr::LockCommand::unlock:
      return unlock(client, wanted);
    case rr::LockCommand::enter_monitor:
      return enter(client, wanted, now);
    case rr::LockCommand::exit_monitor:
      return exit(client, wanted, now);
    default:
      return;  // of leases: see LeaseTable
  }
}

void LockTable::answer(LockClient client, rr::LockRequestId request, rr::Result<> result) {
  if (client != 0) events_.push_back(LockAnswered{client, request, std::move(result)});
}

// --- the device ---

bool LockTable::is_unknown(const rr::Result<>& result) {
  return !result && result.error().code == rr::ErrorCode::request_timeout;
}

void LockTable::ask(Hold& hold, Asking what, LockSession session, rr::LockCommand command,
                    std::chrono::milliseconds timeout) {
  hold.asking = what;
  hold.ask = ++last_ask_;
  events_.push_back(LockAsked{hold.ask, session, command, hold.path, timeout});
}

void LockTable::handle_answer(std::uint64_t id, const rr::Result<>& result, rr::TimePoint now) {
  const auto is_it = [id](const auto& item) { return item.second.ask == id && item.second.asking != Asking::nothing; };
  if (const auto lock = std::find_if(locks_.begin(), locks_.end(), is_it); lock != locks_.end())
    return lock_answered(lock, result);
  if (const auto monitor = std::find_if(monitors_.begin(), monitors_.end(), is_it); monitor != monitors_.end())
    return monitor_answered(monitor, result, now);
}

/// What is asked for is left to its answer, which comes.
void LockTable::handle_lost(LockSession session, rr::TimePoint now) {
  const auto party = std::find_if(parties_.begin(), parties_.end(), [session](const auto& each) {
    return each.second.session == session && each.second.has_own_session;
  });
  // Sessions of one user hear of a restart one after the other: the first counts for all.
  const auto user = party == parties_.end() ? Subject() : party->second.user;
  const std::string why = "it was lost with the connection to the device";
  for (auto it = locks_.begin(); it != locks_.end();) {
    const auto at = it++;
    auto& lock = at->second;
    const bool is_of_user = !lock.user.is_nobody() && lock.user == user;
    const bool is_held = lock.asking == Asking::nothing || lock.asking == Asking::override_it;
    if (!is_held || lock.owner == 0 || (lock.session != session && !is_of_user)) continue;
    note_lost_lock(at->first, lock, why);
    lock.owner = 0;
    if (lock.asking == Asking::nothing) locks_.erase(at);
  }
  for (auto it = monitors_.begin(); it != monitors_.end();) {
    const auto at = it++;
    auto& monitor = at->second;
    if (monitor.session != session || monitor.asking != Asking::nothing) continue;
    lose_monitor(monitor, why);
    hand_on(at, now);
  }
}

void LockTable::handle_released(std::string_view path, rr::TimePoint) {
  const auto canonical = canonical_lock_path(path);
  const std::string why = "its object was replaced";
  for (auto& [key, lock] : locks_) {
    if (!rr::is_within(key, canonical) || lock.asking != Asking::nothing) continue;
    note_lost_lock(key, lock, why);
    take_back_lock(lock, 0);
  }
  for (auto& [key, monitor] : monitors_) {
    if (!rr::is_within(key, canonical) || monitor.asking != Asking::nothing) continue;
    lose_monitor(monitor, why);
    take_back_monitor(monitor, 0);
  }
}

void LockTable::handle_right_lost(LockClient client, std::string_view path, rr::TimePoint) {
  const auto key = canonical_lock_path(path);
  const std::string why = "the right to lock it is gone";
  const rr::Error refused{rr::ErrorCode::permission_denied, why};
  if (const auto found = locks_.find(key); found != locks_.end() && found->second.owner == client) {
    auto& lock = found->second;
    note_lost_lock(key, lock, why);
    if (lock.asking == Asking::take) answer(std::exchange(lock.asker, 0), lock.request, refused);
    // Another client may try to take it, and fail: then it is given back as that of one who has left.
    take_back_lock(lock, lock.asking == Asking::override_it ? client : 0);
  }
  const auto found = monitors_.find(key);
  if (found == monitors_.end()) return;
  auto& monitor = found->second;
  std::erase_if(monitor.queue, [&](const Waiting& waiting) {
    if (waiting.client != client) return false;
    answer(client, waiting.request, refused);
    return true;
  });
  if (monitor.owner != client) return;
  if (monitor.asking == Asking::take) answer(client, monitor.request, refused);
  if (monitor.asking == Asking::give_back) return;
  lose_monitor(monitor, why);
  take_back_monitor(monitor, 0);
}

void LockTable::handle_leased(LockClient client, std::string_view path, const rr::Error& why) {
  const auto key = canonical_lock_path(path);
  for (auto& [at, monitor] : monitors_) {
    if (!rr::is_within(at, key)) continue;
    std::erase_if(monitor.queue, [&](const Waiting& waiting) {
      if (waiting.client == client) return false;
      answer(waiting.client, waiting.request, why);
      return true;
    });
  }
}

// --- object locks ---

bool LockTable::owns(LockClient client, const Hold& lock) const {
  if (lock.owner == client) return true;
  const auto party = parties_.find(client);
  return !lock.user.is_nobody() && party != parties_.end() && party->second.user == lock.user;
}

LockTable::Locks::iterator LockTable::find_covering(std::string_view path) {
  for (;;) {
    if (const auto found = locks_.find(path); found != locks_.end()) return found;
    const auto end = path.rfind('.');
    if (end == std::string_view::npos) return locks_.end();
    path = path.substr(0, end);
  }
}

void LockTable::lock(LockClient client, const rr::LockWanted& wanted) {
  const auto key = canonical_lock_path(wanted.path);
  const auto below = locks_.lower_bound(key + ".");
  const bool is_below = below != locks_.end() && rr::is_within(below->first, key);
  if (is_below || find_covering(key) != locks_.end()) return answer(client, wanted.id, locked("Object already locked"));
  if (locks_.size() >= max_locks)
    return answer(client, wanted.id,
                  rr::make_error(rr::ErrorCode::out_of_system_resource,
                                 std::to_string(max_locks) + " objects of this service are locked already"));
  const auto& party = parties_.at(client);
  const bool is_for_user = wanted.command == rr::LockCommand::lock_for_user;
  auto& lock = locks_[key];
  lock.owner = lock.asker = client;
  lock.session = party.session;
  lock.by = party.user;
  if (is_for_user) lock.user = party.user;
  lock.path = wanted.path;
  lock.request = wanted.id;
  // To the device, the gateway's session is one client. As its user's, the lock would let in another gateway of the
  // same account.
  const auto command = party.has_own_session ? wanted.command : rr::LockCommand::lock_for_client;
  ask(lock, Asking::take, lock.session, command);
}

void LockTable::unlock(LockClient client, const rr::LockWanted& wanted) {
  const auto key = canonical_lock_path(wanted.path);
  const auto& party = parties_.at(client);
  const auto found = find_covering(key);
  if (found == locks_.end()) {
    // A device that has not gone, but was out of reach, may hold for a while what it gave to the session before.
    const bool was_lost = lost_locks_.erase({client, key}) > 0;
    if (!was_lost && !party.has_own_session) return answer(client, wanted.id, {});
    auto& stale = locks_[key];
    stale.path = wanted.path;
    stale.asker = client;
    stale.request = wanted.id;
    stale.session = party.session;
    return ask(stale, was_lost ? Asking::give_back : Asking::override_it, party.session, wanted.command);
  }
  auto& lock = found->second;
  if (found->first != key) return answer(client, wanted.id, locked("Cannot release inherited lock"));
  if (lock.asking != Asking::nothing)
    return answer(client, wanted.id, locked("Object lock is being changed by another request"));
  const bool is_owner = owns(client, lock) || (!lock.by.is_nobody() && lock.by == party.user);
  if (!is_owner && !party.has_own_session)
    return answer(client, wanted.id,
                  locked("Service locked by " + (lock.by.is_nobody() ? "another client" : "user " + lock.by.name)));
  lock.asker = client;
  lock.request = wanted.id;
  lock.path = wanted.path;
  // Whether others' locks may be taken from them is for the device to say, which knows this user.
  ask(lock, is_owner ? Asking::give_back : Asking::override_it, party.session, wanted.command);
}

/// From one who is gone, or has lost it.
void LockTable::take_back_lock(Hold& lock, LockClient leaver) {
  lock.owner = 0;
  lock.user = {};
  lock.leaver = leaver;
  if (lock.asking == Asking::nothing) ask(lock, Asking::give_back, lock.session, rr::LockCommand::unlock);
}

void LockTable::note_lost_lock(const std::string& key, const Hold& lock, const std::string& why) {
  for (const auto& [client, party] : parties_)
    if (owns(client, lock)) lost_locks_[{client, key}] = why;
}

void LockTable::lock_answered(Locks::iterator at, const rr::Result<>& result) {
  auto& lock = at->second;
  const auto was = std::exchange(lock.asking, Asking::nothing);
  const auto asker = std::exchange(lock.asker, 0);
  const auto session = lock.session;
  const auto leaver = lock.leaver;
  if (was == Asking::take && result && lock.owner != 0) {
    std::erase_if(lost_locks_,
                  [&](const auto& lost) { return lost.first.second == at->first && owns(lost.first.first, lock); });
    return answer(asker, lock.request, {});
  }
  if (was == Asking::take && (result || is_unknown(result))) {  // given to nobody, or maybe given
    answer(asker, lock.request, result);
    return take_back_lock(lock, leaver);
  }
  if (was == Asking::override_it && !result && lock.owner != 0) return answer(asker, lock.request, result);
  if (was == Asking::override_it && !result && leaver != 0) {
    answer(asker, lock.request, result);
    return take_back_lock(lock, leaver);
  }
  if (was == Asking::override_it && lock.owner != 0) note_lost_lock(at->first, lock, "another user has released it");
  answer(asker, lock.request, result);
  locks_.erase(at);
  if (was == Asking::give_back && is_unknown(result)) events_.push_back(LockSessionInDoubt{session});
  end_leaving(leaver);
}

// --- what is asked ---

bool LockTable::is_empty() const {
  return locks_.empty() && monitors_.empty() && lost_locks_.empty() && lost_monitors_.empty();
}

std::vector<HeldLock> LockTable::held() const {
  std::vector<HeldLock> out;
  for (const auto& [key, lock] : locks_)
    if (lock.owner != 0)
      out.push_back({lock.user.is_nobody() ? HeldLock::Kind::client : HeldLock::Kind::user, key, lock.by});
  for (const auto& [key, monitor] : monitors_)
    if (monitor.owner != 0) out.push_back({HeldLock::Kind::monitor, key, monitor.by});
  return out;
}

rr::Result<> LockTable::check(LockClient client, std::string_view path, bool is_exempt, rr::TimePoint now) {
  if (is_empty()) return {};
  const auto key = canonical_lock_path(path);
  if (!is_exempt) {
    const auto lock = find_covering(key);
    if (lock != locks_.end() && lock->second.owner != 0 && !owns(client, lock->second))
      return locked("Object locked by " + name_of_holder(lock->second.by));
    for (auto lost = lost_locks_.lower_bound({client, ""}); lost != lost_locks_.end() && lost->first.first == client;
         ++lost)
      if (rr::is_within(key, lost->first.second))
        return locked("the lock of " + rr::quote(lost->first.second) +
                      " is not this client's any more: " + lost->second + "; unlock it, or lock it again");
  }
  return check_monitor(client, key, now);
}

rr::Result<> LockTable::check_below(LockClient client, std::string_view path) const {
  const auto key = canonical_lock_path(path);
  const auto is_free = [&](const auto& held) -> rr::Result<> {
    for (auto at = held.lower_bound(key + "."); at != held.end() && rr::is_within(at->first, key); ++at) {
      const Hold& hold = at->second;
      if (hold.owner == 0 || owns(client, hold)) continue;
      return locked(rr::quote(at->first) + ", which is below, is locked by " + name_of_holder(hold.by));
    }
    return {};
  };
  if (auto allowed = is_free(locks_); !allowed) return allowed;
  return is_free(monitors_);
}

std::vector<std::string> LockTable::paths_of(LockClient client) const {
  std::vector<std::string> out;
  for (const auto& [key, lock] : locks_)
    if (lock.owner == client) out.push_back(key);
  const auto is_his = [client](const Waiting& waiting) { return waiting.client == client; };
  for (const auto& [key, monitor] : monitors_)
    if (monitor.owner == client || std::any_of(monitor.queue.begin(), monitor.queue.end(), is_his)) out.push_back(key);
  return out;
}

bool LockTable::has_at(LockClient client, std::string_view path) const {
  const auto key = canonical_lock_path(path);
  if (lost_locks_.contains({client, key}) || lost_monitors_.contains({client, key})) return true;
  const auto lock = locks_.find(key);
  const auto monitor = monitors_.find(key);
  return (lock != locks_.end() && owns(client, lock->second)) ||
         (monitor != monitors_.end() && monitor->second.owner == client);
}

std::optional<LockSession> LockTable::locked_by(std::string_view path) {
  const auto lock = find_covering(canonical_lock_path(path));
  return lock == locks_.end() ? std::nullopt : std::optional(lock->second.session);
}

std::optional<LockEvent> LockTable::poll_event() {
  if (events_.empty()) return std::nullopt;
  auto event = std::move(events_.front());
  events_.pop_front();
  return event;
}

}  // namespace rrgate
