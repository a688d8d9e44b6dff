#include "core/session/service/object_locks.hpp"

#include "core/session/service_path.hpp"

namespace rr {

namespace {

Error locked(std::string why) {
  return {ErrorCode::object_locked_error, std::move(why)};
}

}  // namespace

ObjectLocks::Locks::const_iterator ObjectLocks::find_covering(std::string_view path) const {
  while (true) {
    if (const auto found = locks_.find(path); found != locks_.end()) return found;
    const auto end = path.rfind('.');
    if (end == std::string_view::npos) return locks_.end();
    path = path.substr(0, end);
  }
}

Result<> ObjectLocks::lock(const std::string& path, const AuthenticatedUser& user, SessionId session) {
  const auto below = locks_.lower_bound(path + ".");
  const bool is_below = below != locks_.end() && below->first.compare(0, path.size() + 1, path + ".") == 0;
  if (is_below || find_covering(path) != locks_.end()) return locked("Object already locked");
  if (locks_.size() >= max_locks)
    return make_error(ErrorCode::out_of_system_resource,
                      std::to_string(max_locks) + " objects of this service are locked already");
  locks_.emplace(path, Lock{user.name, session});
  return {};
}

Result<> ObjectLocks::unlock(const std::string& path, const AuthenticatedUser& user) {
  const auto found = find_covering(path);
  if (found == locks_.end()) return {};
  if (found->first != path) return locked("Cannot release inherited lock");
  if (found->second.user != user.name && !user.has_privilege("objectlockoverride"))
    return locked("Service locked by user " + found->second.user);
  locks_.erase(found);
  return {};
}

Result<> ObjectLocks::check(const std::string& path, const AuthenticatedUser* user, SessionId session) const {
  const auto found = find_covering(path);
  if (found == locks_.end()) return {};
  const auto& lock = found->second;
  if (user && user->name == lock.user && (lock.session == 0 || lock.session == session)) return {};
  return locked("Object locked by " + lock.user);
}

void ObjectLocks::handle_release(std::string_view path) {
  std::erase_if(locks_, [path](const auto& lock) { return is_within(lock.first, path); });
}

void ObjectLocks::handle_login(const std::string& user) {
  ++sessions_[user];
}

void ObjectLocks::handle_logout(const std::string& user, SessionId session) {
  const auto found = sessions_.find(user);
  const bool was_last = found == sessions_.end() || --found->second == 0;
  if (was_last && found != sessions_.end()) sessions_.erase(found);
  std::erase_if(locks_, [&](const auto& lock) {
    return lock.second.user == user && (was_last || lock.second.session == session);
  });
}

}  // namespace rr
