// What says who may: users, tokens, keys and rights, as the configuration and its files have them at one time.
// Layer: server/access.
#pragma once

#include <map>
#include <memory>
#include <optional>
#include <string>

#include "node/service/password_file.hpp"
#include "node/tls/revocations.hpp"
#include "server/access/access_config.hpp"
#include "server/access/access_rules.hpp"
#include "server/access/api_tokens.hpp"

namespace rrgate {

/// Fewer bytes could be guessed from one ticket.
inline constexpr std::size_t min_ticket_key = 32;

/// What the configuration and its files say at one time. Never changes once made.
struct AccessState {
  AccessConfig config = {};
  std::map<std::string, std::string> looks = {};  ///< of each file what tells that it was changed, before it was read
  AccessRules rules = {};
  std::shared_ptr<const rr::PasswordFileAuthenticator> users = {};  ///< null: no users file
  std::optional<ApiTokens> tokens = {};
  std::optional<JwtVerifier> jwt = {};
  rr::Revocations revoked = {};  ///< client certificates
  rr::Bytes ticket_key = {};     ///< empty: the gateway's own
};
using AccessStatePtr = std::shared_ptr<const AccessState>;

/// Reads the files. Errors   invalid_configuration, io_error: which can't be used, and why.
[[nodiscard]] rr::Result<AccessStatePtr> load_access(const AccessConfig& config);

/// Of each file that load_access() reads, what tells that it was changed.
std::map<std::string, std::string> look_at_files(const AccessConfig& config);

}  // namespace rrgate
