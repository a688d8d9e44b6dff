// What an operator says about who may do what. Layer: server/access. Mirrors "access" of gateway.schema.json.
#pragma once

#include <string>
#include <vector>

#include "node/tls/client_certificates.hpp"
#include "server/access/access_rules.hpp"
#include "server/access/audit_config.hpp"
#include "server/access/jwt.hpp"

namespace rrgate {

struct JwtConfig {
  std::string jwks_file = {};    ///< a JSON Web Key Set
  std::string secret_file = {};  ///< for HS256
  JwtClaims claims = {};
  bool discovers = false;  ///< the keys are those that the issuer has published (IssuerKeys)
  std::vector<std::string> ca =
      {};  ///< PEM files: who may vouch for the issuer's server; empty: whom this system trusts

  bool is_used() const { return !jwks_file.empty() || !secret_file.empty() || discovers; }
  bool operator==(const JwtConfig&) const = default;
};

/// Headers in which trusted proxies say who a client is; a proxy must take away what clients put there themselves.
struct IdentityHeaders {
  std::string user = {};   ///< empty: none
  std::string roles = {};  ///< words with blanks, commas or '|' between; empty: none

  bool operator==(const IdentityHeaders&) const = default;
};

/// Roles for users of a name, however proven. Tokens have theirs in their file: who asks for one chooses its name.
struct RoleGrant {
  std::vector<std::string> users = {};  ///< patterns with '*' and '?'
  std::vector<std::string> roles = {};

  bool operator==(const RoleGrant&) const = default;
};

struct AccessConfig {
  std::string users_file = {};
  std::string tokens_file = {};
  JwtConfig jwt = {};
  std::string ticket_key_file = {};  ///< of gateways that take each other's tickets; empty: a key of its own
  rr::ClientTrust clients = {};      ///< TLS clients are asked for a certificate where there are CAs for it
  IdentityHeaders identity_headers = {};
  std::string anonymous_role = {};  ///< of who has shown nothing; empty: he has none
  std::vector<RoleGrant> grants = {};
  std::vector<AccessRule> rules = {};
  AuditConfig audit = {};  ///< "audit" of the configuration; its file also "audit_file" of "access"

  /// Whether there is a way to prove who one is.
  bool has_users() const {
    return !users_file.empty() || !tokens_file.empty() || jwt.is_used() || !clients.ca.empty() ||
           !identity_headers.user.empty();
  }
  bool operator==(const AccessConfig&) const = default;
};

}  // namespace rrgate
