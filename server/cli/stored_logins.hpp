// Logins that a user keeps for gateways, in a file of his own. Layer: server/cli.
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace rrgate {

/// A token, or a name and its password; all empty: none is kept.
struct StoredLogin {
  std::string user = {};
  std::string password = {};
  std::string token = {};
};

/// Of $XDG_CONFIG_HOME/rrgate/logins.json, else of ~/.config: {"gateways": {"https://host": {"token": "..."}}}.
/// `gateway`  as gateway_base() has it. Throws   NotUnderstood: others may read the file, or it is not of this form.
StoredLogin find_stored_login(std::string_view gateway);
/// All that have a login there, as gateway_base() has them. Throws   the same.
std::vector<std::string> gateways_of_stored_logins();

}  // namespace rrgate
