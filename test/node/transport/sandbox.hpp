// Folders of one test alone, for nodes of this machine. Test support.
#pragma once

#include <stdlib.h>

#include <filesystem>
#include <stdexcept>
#include <string>
#include <vector>

namespace rr {

/// By the variables of the reference.
class Sandbox {
 public:
  Sandbox() {
    char name[] = "/tmp/rrgate-local-XXXXXX";
    if (::mkdtemp(name) == nullptr) throw std::runtime_error("no folder below /tmp");
    folder_ = name;
    set("ROBOTRACONTEUR_SYSTEM_PREFIX", folder_);
    set("ROBOTRACONTEUR_USER_HOME", folder_ + "/home");
    set("ROBOTRACONTEUR_USER_RUN_DIR", folder_ + "/run");
  }
  ~Sandbox() {
    for (const auto& name : names_) ::unsetenv(name.c_str());
    std::filesystem::remove_all(folder_);
  }
  void set(const std::string& name, const std::string& value) {
    ::setenv(name.c_str(), value.c_str(), 1);
    names_.push_back(name);
  }
  const std::string& folder() const { return folder_; }

 private:
  std::string folder_;
  std::vector<std::string> names_;
};

}  // namespace rr
