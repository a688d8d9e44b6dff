// Whether a file is another one than before. Layer: node/platform.
#pragma once

#include <sys/stat.h>

#include <string>

namespace rr {

/// What tells that a file was changed or replaced; empty where there is none.
inline std::string file_look(const std::string& path) {
  struct stat status {};
  if (::stat(path.c_str(), &status) != 0) return {};
  return std::to_string(status.st_mtim.tv_sec) + "." + std::to_string(status.st_mtim.tv_nsec) + " " +
         std::to_string(status.st_ino) + " " + std::to_string(status.st_size);
}

}  // namespace rr
