// Rights of clients of shared devices: which services they get to, and member by member. Layer: server/rr.
#pragma once

#include <memory>
#include <string_view>

#include "core/session/service/service_session.hpp"
#include "server/access/standing.hpp"
#include "server/rr/shared_node.hpp"

namespace rrgate {

/// Of one session: what its connection has shown counts, or, once it has logged in at the gateway, as whom.
class SessionRights {
 public:
  /// `access` and `node` outlive it. `device`  the one that the node stands for; empty: the gateway's own node.
  SessionRights(Access& access, const SharedNode& node, std::string device, StandingPtr shown)
      : access_(access), node_(node), device_(std::move(device)), shown_(std::move(shown)) {}

  /// For ServiceSessionOptions::admit, but for requests of locks and leases, which may be to give something back: see
  /// admit_lock(). Errors   permission_denied; authentication_error: a login may help.
  /// `is_vital`  see AccessRequest.
  [[nodiscard]] rr::Result<> admit(const rr::MemberAccess& wanted, bool is_vital);
  /// What is to be recorded of something that was admitted; see Access::begin().
  AuditEntryPtr begin(const rr::MemberAccess& admitted);
  /// Of what was admitted, but asked for too often.
  void record_too_much(const rr::MemberAccess& admitted, std::string_view why);
  /// Whether the client may lock an object. Errors   permission_denied.
  [[nodiscard]] rr::Result<> admit_lock(std::string_view path, const rr::AuthenticatedUser* user, Recorded recorded);
  /// Whether the client may write or call anything at or below an object.
  bool may_command(std::string_view path, const rr::AuthenticatedUser* user);
  AuditEntryPtr begin_lock(const rr::LockWanted& wanted, const rr::AuthenticatedUser* user);
  bool has_role(std::string_view role, const rr::AuthenticatedUser* user) {
    return standing_of(user).identity().has_role(role);
  }
  /// Whether all that was shown is still good; see Standing.
  bool is_good() { return shown_->is_good() && (!user_ || user_->is_good()); }
  /// Whether anything that rights hang on has changed since the last time that this was asked.
  bool have_changed(const rr::AuthenticatedUser* user);

 private:
  /// Whose rights count. `user`  null: has not logged in.
  Standing& standing_of(const rr::AuthenticatedUser* user);
  AuditEntryPtr begin(AccessRequest what, const rr::AuthenticatedUser* user, std::string_view event);
  rr::Result<> admit_to_service(Standing& asker, const rr::MemberAccess& wanted, std::string_view service);

  Access& access_;
  const SharedNode& node_;
  std::string device_;
  StandingPtr shown_;
  StandingPtr user_;  ///< as whom it has logged in; null: it has not
  Subject user_is_;
  AccessStatePtr reviewed_by_;  ///< and as whom, when have_changed() was asked last
  Subject reviewed_as_;
};

}  // namespace rrgate
