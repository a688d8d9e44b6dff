// Whether a file is another one than before. Layer: node/platform.
#pragma once

#include <sys/stat.h>

#include <string>

namespace rr {

/// What tells that a file was changed or replaced, or given to somebody else; empty where there is none.
inline std::string file_look(const std::string& path) {
  struct stat status {};
  if (::stat(path.c_str(), &status) != 0) return {};
  const auto text = [](const timespec& time) {
    return std::to_string(time.tv_sec) + "." + std::to_string(time.tv_nsec);
  };
  return text(status.st_mtim) + " " + text(status.st_ctim) + " " + std::to_string(status.st_ino) + " " +
         std::to_string(status.st_size);
}

}  // namespace rr
