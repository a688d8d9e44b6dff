// Who a client is: what a login asks, what it yields, and how often one may try. Layer: session.
// Source: sessions spec section 2.15.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/session/connection.hpp"
#include "core/types/value.hpp"

namespace rr {

/// A user who has logged in.
struct AuthenticatedUser {
  std::string name;
  std::vector<std::string> privileges = {};  ///< "objectlock", "objectlockoverride"; others are the application's
  MapString properties = {};                 ///< for the application; never on the wire

  bool has_privilege(std::string_view privilege) const;
};

/// What a client showed in order to log in. The credentials are secret: they belong into no text.
struct LoginAttempt {
  std::string username;
  MapString credentials;
  std::string service;
  NodeIdentity peer;                            ///< as the client says
  std::optional<NodeId> verified_node_id = {};  ///< as the transport vouches for: a certificate, the local machine
};

/// Decides on logins. Attempts may be judged on any thread, several at the same time.
class Authenticator {
 public:
  virtual ~Authenticator() = default;
  /// Errors   authentication_error, with a text that the client gets to see: it holds no secret and does not tell an
  ///          unknown user from a wrong password.
  virtual Result<AuthenticatedUser> authenticate(const LoginAttempt& attempt) const = 0;
};

/// The rules of one service. By default everybody may use it and nobody can log in.
struct SecurityPolicy {
  std::shared_ptr<const Authenticator> authenticator = {};
  /// `requirevaliduser`: a client that has not logged in can do so, keep its session alive, and nothing else.
  bool require_valid_user = false;
  /// `allowobjectlock`: without it object locks are refused (152). The reference reads this policy and ignores it: true
  /// is how its services behave.
  bool allow_object_lock = false;
  std::size_t max_failed_logins = 5;  ///< of one connection: then it is closed
};

/// How often a whole service lets its clients try: guessing on many connections at once is no faster, and the work of
/// judging logins is bounded. In front of a remote service whoever judges has limits of its own.
class LoginLimit {
 public:
  /// `max_failures`  in a row; one is forgotten each second.
  explicit LoginLimit(std::size_t max_failures = 60, std::size_t max_judged_at_once = 64)
      : max_failures_(max_failures), max_judged_at_once_(max_judged_at_once) {}

  /// Kept for as long as a login is being judged.
  using Ticket = std::shared_ptr<const void>;

  /// Errors   authentication_error: too many have failed; out_of_system_resource: too many are being judged.
  Result<Ticket> begin(Now now);
  void handle_failure(Now now);

 private:
  void forget_failures(Now now);

  std::size_t max_failures_;
  std::size_t max_judged_at_once_;
  Ticket tickets_ = std::make_shared<const char>('\0');
  std::size_t failures_ = 0;
  TimePoint forgotten_until_ = {};
};

/// Whether nobody could judge a login, since whoever would is away: its client is told so, and it is no failed one.
inline bool is_unjudged(const Error& error) {
  return error.code == ErrorCode::connection_error;
}

}  // namespace rr
