// User and client locks of one service's objects. Layer: session. Source: sessions spec section 2.6.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <string_view>

#include "core/session/service/authenticator.hpp"

namespace rr {

/// One session of a service; never 0, never used again.
using SessionId = std::uint64_t;

/// Who has locked what. A lock holds for its object and everything below it; no two locks overlap. Paths are canonical
/// (canonical_path()): other spellings of an index open nothing.
class ObjectLocks {
 public:
  /// `session`  0: a user lock, for all sessions of the user; otherwise a lock for this one alone.
  /// Errors   object_locked_error: the path, or something above or below it, is locked, if only by the same user;
  ///          out_of_system_resource.
  Result<> lock(const std::string& path, const AuthenticatedUser& user, SessionId session);
  /// Also of another session of the same user, and of anybody's for those with objectlockoverride; no lock is no error.
  /// Errors   object_locked_error: inherited from above, or somebody else's.
  Result<> unlock(const std::string& path, const AuthenticatedUser& user);
  /// Whether a client may use the members of an object. `user` null: has not logged in.
  /// Errors   object_locked_error "Object locked by USER".
  Result<> check(const std::string& path, const AuthenticatedUser* user, SessionId session) const;
  bool empty() const { return locks_.empty(); }
  std::size_t size() const { return locks_.size(); }

  /// The object of `path` is replaced: it and what is below it are no longer those that were locked.
  void handle_release(std::string_view path);
  void handle_login(const std::string& user);
  /// Frees the session's client locks, and with its last session all locks of the user.
  void handle_logout(const std::string& user, SessionId session);

 private:
  struct Lock {
    std::string user;
    SessionId session = 0;
  };
  using Locks = std::map<std::string, Lock, std::less<>>;
  static constexpr std::size_t max_locks = 1024;

  /// The lock of the path itself or of one above.
  Locks::const_iterator find_covering(std::string_view path) const;

  Locks locks_;
  std::map<std::string, std::size_t, std::less<>> sessions_;  ///< of each user
};

}  // namespace rr
