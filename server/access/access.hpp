// Who may do what with the gateway and its devices: users, tokens, rights, and the record of it. Layer: server/access.
#pragma once

#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include "core/session/service/authenticator.hpp"
#include "server/access/access_state.hpp"
#include "server/access/audit_entry.hpp"
#include "server/access/refusal_digest.hpp"
#include "server/access/sign_ins.hpp"
#include "server/access/tickets.hpp"

namespace rrgate {

/// The user's name among those of the gateway's users, or of the device's, whoever has judged the login.
Subject subject_of(const rr::AuthenticatedUser& user);

/// Judges a login by a users file, so that subject_of() knows who has. From any thread.
/// Errors   authentication_error; see rr::Authenticator.
rr::Result<rr::AuthenticatedUser> judge_login(const rr::PasswordFileAuthenticator& users,
                                              const rr::LoginAttempt& attempt);

/// Used from the gateway's thread, the authenticator from any. Rights that change hold for the next request; sessions
/// that are open go on.
class Access {
 public:
  explicit Access(const AccessConfig& config);
  Access(const Access&) = delete;
  Access& operator=(const Access&) = delete;
  ~Access();

  /// Reads all files, and opens the audit log. Errors   as load_access(); nothing has changed.
  [[nodiscard]] rr::Result<> load();
  /// Goes on with another configuration, whose files load_access() has read.
  /// Errors   io_error: an audit file that can't be opened; nothing has changed.
  [[nodiscard]] rr::Result<> replace(AccessStatePtr next);
  /// Reads the files anew: those that changed, or all. What can't be used stays as it was, and the log says why.
  void reload(bool is_forced);

  /// The keys that the issuer has published (JwtConfig::discovers). Errors   invalid_configuration: none can be used;
  /// those from before stay in use, as they do when the configuration changes and the issuer does not.
  [[nodiscard]] rr::Result<> take_issuer_keys(const std::string& issuer, std::string key_set);

  /// Whether somebody may do something. Refusals go into the audit log.
  /// Errors   permission_denied: a sentence for the client; out_of_system_resource: it has to be recorded, and can't
  /// be.
  [[nodiscard]] rr::Result<> check(const Identity& who, const AccessRequest& what);
  /// What is to be recorded of something that may be done: writes, calls, locks, subscriptions. `event`  a literal;
  /// empty: the verb.
  AuditEntryPtr begin(const Identity& who, const AccessRequest& what, std::string_view trace = {},
                      std::string_view event = {});
  /// Both in one.
  [[nodiscard]] rr::Result<AuditEntryPtr> check_and_begin(const Identity& who, const AccessRequest& what,
                                                          std::string_view trace = {}, std::string_view event = {});
  /// Whether somebody's bytes may pass unread, to and from a device. Errors   as check().
  [[nodiscard]] rr::Result<> check_whole_device(const Identity& who, std::string_view device);
  /// See AccessRules::sees().
  bool sees(const Identity& who, std::string_view device, std::optional<std::string_view> service = {},
            std::optional<std::string_view> path = {}) const {
    return state_->rules.sees(who, device, service, path);
  }
  /// Everybody may do everything.
  bool is_open() const { return state_->rules.is_open(); }
  const AccessState& state() const { return *state_; }
  /// Another one whenever users, tokens or rights have changed.
  const AccessStatePtr& state_ptr() const { return state_; }

  /// Logins of Robot Raconteur by the users file; follows its changes. Null where there is none. See Logins.
  std::shared_ptr<const rr::Authenticator> authenticator() const;

  Tickets& tickets() { return tickets_; }
  const SignIns& sign_ins() const { return sign_ins_; }
  /// Ends a sign-in, and what goes on by it. False: too many have ended lately; its cookies are good on.
  bool sign_out(const Identity& who);

  // Identities, with the roles that the configuration adds. `client`: where from, as logs name it.
  Identity anonymous(std::string client, Face face = Face::none) const;
  /// A user of the users file, who has logged in.
  Identity logged_in(const rr::AuthenticatedUser& user, std::string client, Face face = Face::none) const;
  /// Who the client of a session is. `shown`  by its connection. `user`  as whom it has logged in since; null: it has
  /// not. A user whom authenticator() has not judged is a device's: that changes no right here.
  Identity in_session(const Identity& shown, const rr::AuthenticatedUser* user) const;
  /// Any other that is proven; its roles are those of the proof.
  Identity with_grants(Identity identity) const;
  /// The same client by the users, tokens and rights of now. nullopt: what it has shown was revoked or has expired.
  std::optional<Identity> renew(const Identity& who) const;

  void record(const AuditEvent& event) { audit_->add(event); }
  /// The same for what was refused: of those who have not proven who they are, one of a network a minute.
  void record_refusal(const AuditEvent& event);
  /// The same for what was asked for too often, also of those who have proven who they are. `what`  null: not known
  /// yet.
  void record_too_much(const Identity& who, const AccessRequest* what, std::string_view why);
  /// Writes how many refusals were left out, where a minute is over, and tells the gateway's log where the audit log
  /// can't be written, or can again. To be called now and then.
  void tend_audit(bool is_forced = false);
  AuditLog& audit() { return *audit_; }

 private:
  class Users;

  explicit Access(const AccessConfig& config, const rr::Bytes& key);
  void take(AccessStatePtr next);
  /// What becomes of users and tokens with `next`.
  void record_changes(const AccessState& next);
  /// What has come into the users file, and what has gone from it; the same of the tokens file.
  void record_users(const AccessState& before, const AccessState& now);
  void record_tokens(const AccessState& before, const AccessState& now);

  AccessStatePtr state_;
  bool is_loaded_ = false;
  std::map<std::string, std::string> seen_;
  std::shared_ptr<AuditLog> audit_;  ///< entries may outlive this
  std::shared_ptr<Users> users_;
  std::string issuer_;  ///< whose keys these are:
  std::string issuer_keys_;
  Tickets tickets_;
  SignIns sign_ins_;
  RefusalDigest refusals_;
  RefusalDigest too_much_;
  bool is_failing_ = false;  ///< the audit log, as far as the log has been told
};

}  // namespace rrgate
