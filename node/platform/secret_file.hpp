// Files for the owner's eyes alone, or for those of a service too. Layer: node/platform.
#pragma once

#include <filesystem>
#include <string_view>

#include "core/support/error.hpp"

namespace rr {

enum class SecretReaders {
  owner,         ///< nobody else
  folder_group,  ///< also the group that the file's folder was given to, where root writes: a service that reads it
};

/// Writes a file with mode 0600, in a folder with mode 0700 where there is none yet. Whoever reads meanwhile finds the
/// old file or the new one whole. A file that is replaced keeps its owner, its group and whether the group may read it.
/// Root gives a new folder to the owner and group of the folder above (mode 0750), and with `folder_group` a new file
/// to those of its folder (mode 0640): unless that group is root's, or everybody may write into the folder.
/// Errors   operation_failed: the file is there already and may not be replaced; io_error.
Result<> write_secret(const std::filesystem::path& path, std::string_view text, bool may_replace,
                      SecretReaders readers = SecretReaders::owner);

}  // namespace rr
