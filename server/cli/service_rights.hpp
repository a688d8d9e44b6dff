// What the user that runs the service can't read or write of a configuration. Layer: server/cli.
#pragma once

#include <string>
#include <vector>

#include "core/support/error.hpp"
#include "server/config/config.hpp"

namespace rrgate {

/// One sentence for each file that `user` can't use as `rrgate serve` would. Asked by a process of that user.
/// Errors   invalid_argument: there is no such user; system_resource_permission_denied: only root may ask for another
/// one.
rr::Result<std::vector<std::string>> find_missing_rights(const std::string& user, const std::string& file,
                                                         const Config& config);

}  // namespace rrgate
