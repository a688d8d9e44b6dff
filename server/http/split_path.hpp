// The parts of a path. Layer: server/http.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "core/support/error.hpp"

namespace rrgate {

/// Between the slashes, decoded. A slash at the end adds nothing.
/// Errors   a bad escape; object_not_found: more than 64 parts.
rr::Result<std::vector<std::string>> split_path(std::string_view path);

}  // namespace rrgate
