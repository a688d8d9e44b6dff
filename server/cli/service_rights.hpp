// What the user that runs the service can't read or write of a configuration. Layer: server/cli.
#pragma once

#include <string>
#include <vector>

#include "core/support/error.hpp"
#include "server/config/config.hpp"

namespace rrgate {

struct MissingRights {
  std::vector<std::string> needed;    ///< without them the gateway does not start, or does not do what it is told to
  std::vector<std::string> optional;  ///< without them something that people may ask the gateway for fails
};

/// One sentence for each file that `user` can't use as `rrgate serve` would. Asked by a process of that user.
/// Errors   invalid_argument: there is no such user; system_resource_permission_denied: only root may ask for another
/// one.
rr::Result<MissingRights> find_missing_rights(const std::string& user, const std::string& file, const Config& config);

}  // namespace rrgate
