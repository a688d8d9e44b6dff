#include "server/upstream/lease_table.hpp"

#include <algorithm>

#include "core/session/service_path.hpp"
#include "server/upstream/lock_path.hpp"

namespace rrgate {

namespace {

constexpr std::size_t max_leases = 1024;
/// Of one client, with those that it has lost and not released: nobody can take all of them from the others.
constexpr std::size_t max_leases_of_client = 128;

rr::Error kept_by(const HeldLease& lease) {
  return rr::make_error(rr::ErrorCode::object_locked_error,
                        (lease.by.is_nobody() ? std::string("another client") : rr::quote(lease.by.name)) +
                            " has the lease of " + rr::quote(lease.path));
}

bool overlap(std::string_view one, std::string_view other) {
  return rr::is_within(one, other) || rr::is_within(other, one);
}

}  // namespace

std::vector<LeaseTable::Leases::iterator> LeaseTable::others_around(LockClient client, std::string_view key) {
  std::vector<Leases::iterator> out;
  for (auto it = leases_.begin(); it != leases_.end(); ++it)
    if (it->second.holder != client && overlap(key, it->first)) out.push_back(it);
  return out;
}

std::size_t LeaseTable::count_besides(LockClient client, std::string_view key) const {
  const auto is_other = [&](const auto& lease) { return lease.second.holder == client && !overlap(key, lease.first); };
  auto out = static_cast<std::size_t>(std::count_if(leases_.begin(), leases_.end(), is_other));
  for (auto lost = lost_.lower_bound({client, ""}); lost != lost_.end() && lost->first.first == client; ++lost)
    if (!overlap(key, lost->first.second)) ++out;
  return out;
}

rr::Result<> LeaseTable::acquire(LockClient client, const Subject& by, std::string_view path, milliseconds deadman,
                                 bool takes_over, rr::TimePoint now) {
  if (deadman < shortest_deadman || deadman > longest_deadman)
    return rr::make_error(rr::ErrorCode::invalid_argument, "a dead-man's time of " + std::to_string(deadman.count()) +
                                                               " ms: expected " +
                                                               std::to_string(shortest_deadman.count()) + " to " +
                                                               std::to_string(longest_deadman.count()));
  handle_timeout(now);
  const auto key = canonical_lock_path(path);
  for (const auto& [known, lease] : leases_)
    if (lease.holder == client && known != key && overlap(known, key))
      return rr::make_error(rr::ErrorCode::invalid_operation,
                            "this client has the lease of " + rr::quote(known) + " already: release it first");
  if (count_besides(client, key) >= max_leases_of_client)
    return rr::make_error(rr::ErrorCode::out_of_system_resource,
                          "this client has " + std::to_string(max_leases_of_client) +
                              " leases, or has lost them and not released them: release some first");
  const auto others = others_around(client, key);
  if (!others.empty() && !takes_over) return kept_by(others.front()->second);
  if (others.empty() && !leases_.contains(key) && leases_.size() >= max_leases)
    return rr::make_error(rr::ErrorCode::out_of_system_resource,
                          std::to_string(max_leases) + " leases of this service are held already");
  for (const auto& other : others) end(other, "it was taken over by " + (by.is_nobody() ? "another client" : by.name));
  std::erase_if(lost_, [&](const auto& each) { return each.first.first == client && overlap(each.first.second, key); });
  auto& lease = leases_[key];
  lease.path = key;
  lease.holder = client;
  lease.by = by;
  lease.deadman = deadman;
  lease.deadline = now + deadman;
  return {};
}

rr::Error LeaseTable::not_held(LockClient client, const std::string& key) const {
  const auto lost = lost_.find({client, key});
  return rr::make_error(rr::ErrorCode::invalid_operation,
                        lost == lost_.end() ? "this client has no lease of " + rr::quote(key)
                                            : "the lease of " + rr::quote(key) + " has ended: " + lost->second);
}

rr::Result<> LeaseTable::renew(LockClient client, std::string_view path, rr::TimePoint now) {
  handle_timeout(now);
  const auto key = canonical_lock_path(path);
  const auto found = leases_.find(key);
  if (found == leases_.end() || found->second.holder != client) return not_held(client, key);
  found->second.deadline = now + found->second.deadman;
  return {};
}

rr::Result<> LeaseTable::release(LockClient client, std::string_view path, rr::TimePoint now) {
  handle_timeout(now);
  const auto key = canonical_lock_path(path);
  if (lost_.erase({client, key}) > 0) return {};
  const auto found = leases_.find(key);
  if (found == leases_.end() || found->second.holder != client) return not_held(client, key);
  end(found, "its holder has released it");
  lost_.erase({client, key});
  return {};
}

rr::Result<> LeaseTable::check(LockClient client, std::string_view path, LeaseNeed need, rr::TimePoint now) {
  if (is_empty() && need != LeaseNeed::required) return {};
  handle_timeout(now);
  const auto key = canonical_lock_path(path);
  for (const auto& [known, lease] : leases_) {
    if (!rr::is_within(key, known)) continue;
    if (lease.holder == client) return {};
    return kept_by(lease);
  }
  for (auto lost = lost_.lower_bound({client, ""}); lost != lost_.end() && lost->first.first == client; ++lost)
    if (rr::is_within(key, lost->first.second))
      return rr::make_error(rr::ErrorCode::object_locked_error, "the lease of " + rr::quote(lost->first.second) +
                                                                    " has ended: " + lost->second +
                                                                    "; release it, or take it again");
  if (need != LeaseNeed::required) return {};
  return rr::make_error(rr::ErrorCode::object_locked_error,
                        "this needs the lease of " + rr::quote(key) + ", which nobody has: take it first");
}

rr::Result<> LeaseTable::check_lock(LockClient client, std::string_view path, rr::TimePoint now) {
  if (is_empty()) return {};
  handle_timeout(now);
  const auto others = others_around(client, canonical_lock_path(path));
  return others.empty() ? rr::Result<>() : kept_by(others.front()->second);
}

bool LeaseTable::has_at(LockClient client, std::string_view path) const {
  const auto key = canonical_lock_path(path);
  const auto lease = leases_.find(key);
  return lost_.contains({client, key}) || (lease != leases_.end() && lease->second.holder == client);
}

bool LeaseTable::is_held(std::string_view path) const {
  return std::any_of(leases_.begin(), leases_.end(),
                     [key = canonical_lock_path(path)](const auto& lease) { return rr::is_within(key, lease.first); });
}

void LeaseTable::handle_gone(LockClient client) {
  for (auto it = leases_.begin(); it != leases_.end();) {
    const auto at = it++;
    if (at->second.holder == client) end(at, "the connection of its holder has ended");
  }
  std::erase_if(lost_, [client](const auto& each) { return each.first.first == client; });
}

void LeaseTable::handle_lost(std::string_view path, const std::string& why) {
  if (const auto found = leases_.find(path); found != leases_.end()) end(found, why);
}

void LeaseTable::handle_lost(const std::string& why) {
  while (!leases_.empty()) end(leases_.begin(), why);
}

void LeaseTable::handle_timeout(rr::TimePoint now) {
  for (auto it = leases_.begin(); it != leases_.end();) {
    const auto at = it++;
    if (at->second.deadline <= now)
      end(at, "its holder has not renewed it for " + std::to_string(at->second.deadman.count()) + " ms");
  }
}

void LeaseTable::end(Leases::iterator at, const std::string& why) {
  auto lease = std::move(at->second);
  lost_[{lease.holder, lease.path}] = why;
  leases_.erase(at);
  events_.push_back({std::move(lease), why});
}

std::optional<LeaseEnded> LeaseTable::poll_event() {
  if (events_.empty()) return std::nullopt;
  auto event = std::move(events_.front());
  events_.pop_front();
  return event;
}

rr::TimePoint LeaseTable::poll_timeout() const {
  auto next = rr::TimePoint::max();
  for (const auto& [key, lease] : leases_) next = std::min(next, lease.deadline);
  return next;
}

std::vector<HeldLease> LeaseTable::held() const {
  std::vector<HeldLease> out;
  for (const auto& [key, lease] : leases_) out.push_back(lease);
  return out;
}

}  // namespace rrgate
