// Files for the owner's eyes alone. Layer: node/platform.
#pragma once

#include <filesystem>
#include <string_view>

#include "core/support/error.hpp"

namespace rr {

/// Writes a file with mode 0600, in a folder with mode 0700 where there is none yet. Whoever reads meanwhile finds the
/// old file or the new one whole. A file that is replaced keeps its owner, as far as this process may give it away.
/// Errors   operation_failed: the file is there already and may not be replaced; io_error.
Result<> write_secret(const std::filesystem::path& path, std::string_view text, bool may_replace);

}  // namespace rr
