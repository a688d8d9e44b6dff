// Users from a text: the reference's password file, and the same with scrypt. Layer: node/service.
// Source: sessions spec section 2.15.
#pragma once

#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/session/service/authenticator.hpp"
#include "node/service/password_hash.hpp"

namespace rr {

struct PasswordFileOptions {
  /// Takes the reference's unsalted MD5 hashes, which are soon guessed by whoever gets to see the file.
  bool accepts_md5 = false;
  /// Only clients whose NodeID the transport vouches for; where a line lists NodeIDs, only these.
  bool requires_verified_client = false;
};

/// One user a line, fields separated by blanks:
///
///   name  hash  privilege,privilege|_  [nodeid,nodeid...]
///
/// `hash` as PasswordHash::parse() reads it, `_` for no privileges. Empty lines are skipped; the first line of a name
/// counts. Clients log in with the credential `password`, a text.
class PasswordFileAuthenticator final : public Authenticator {
 public:
  /// Errors   invalid_configuration: names the line, never what stands in its hash.
  static Result<std::shared_ptr<const PasswordFileAuthenticator>> from_text(std::string_view text,
                                                                            PasswordFileOptions options = {});
  /// Errors   also io_error: the file cannot be read.
  static Result<std::shared_ptr<const PasswordFileAuthenticator>> from_file(const std::string& path,
                                                                            PasswordFileOptions options = {});

  Result<AuthenticatedUser> authenticate(const LoginAttempt& attempt) const override;
  std::size_t user_count() const { return users_.size(); }

  /// What the file says of a user.
  struct Entry {
    std::string hash;  ///< of his password, as the file has it
    std::vector<std::string> privileges;
  };
  /// nullopt: there is no user of this name.
  std::optional<Entry> find(std::string_view name) const;
  std::vector<std::string> names() const;

 private:
  struct User {
    PasswordHash hash;
    std::vector<std::string> privileges;
    std::vector<NodeId> nodes;
  };

  PasswordFileAuthenticator() = default;
  Result<> add_line(std::string_view line);
  static Result<> check_node(const LoginAttempt& attempt, const User& user);

  PasswordFileOptions options_;
  std::map<std::string, User, std::less<>> users_;
};

}  // namespace rr
