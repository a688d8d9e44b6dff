#include "node/platform/folders.hpp"

#include <pwd.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <cstdlib>
#include <span>
#include <vector>

namespace rr {

namespace fs = std::filesystem;

namespace {

struct Place {
  const char* variable;
  const char* below;  ///< appended to its value
};

bool is_root() {
  return ::geteuid() == 0;
}

const char* environment(const char* name) {
  const char* const value = std::getenv(name);
  return value != nullptr && *value != '\0' ? value : nullptr;
}

/// The first place whose variable is set; `otherwise` where none is.
Result<fs::path> first_of(std::span<const Place> places, const fs::path& otherwise) {
  for (const auto& place : places) {
    const char* const value = environment(place.variable);
    if (value == nullptr) continue;
    const fs::path folder(value);
    if (!folder.is_absolute())
      return make_error(ErrorCode::invalid_configuration,
                        std::string(place.variable) + " is " + rr::quote(value) + ", expected an absolute path");
    return *place.below != '\0' ? folder / place.below : folder;
  }
  if (otherwise.empty())
    return make_error(ErrorCode::invalid_configuration, "no folder for Robot Raconteur's files: HOME is not set");
  return otherwise;
}

Result<fs::path> system_folder(const char* variable, std::string_view usual) {
  const char* const prefix = environment("ROBOTRACONTEUR_SYSTEM_PREFIX");
  const Place place{variable, ""};
  return first_of(std::span(&place, 1), (prefix ? prefix : "") + std::string(usual));
}

}  // namespace

Result<fs::path> user_config_folder() {
  if (is_root()) return system_folder("ROBOTRACONTEUR_SYSTEM_CONFIG_DIR", "/etc/robotraconteur");
  constexpr std::array<Place, 4> places{{{"ROBOTRACONTEUR_USER_CONFIG_DIR", ""},
                                         {"ROBOTRACONTEUR_USER_HOME", ".config/RobotRaconteur"},
                                         {"XDG_CONFIG_HOME", "RobotRaconteur"},
                                         {"HOME", ".config/RobotRaconteur"}}};
  return first_of(places, {});
}

Result<fs::path> system_run_folder() {
  return system_folder("ROBOTRACONTEUR_SYSTEM_RUN_DIR", "/var/run/robotraconteur");
}

Result<fs::path> system_state_folder() {
  return system_folder("ROBOTRACONTEUR_SYSTEM_STATE_DIR", "/var/lib/robotraconteur");
}

Result<fs::path> user_state_folder() {
  return is_root() ? system_state_folder() : user_config_folder();
}

Result<fs::path> user_run_folder() {
  if (is_root()) {
    const auto system = system_run_folder();
    if (!system) return system;
    return *system / "root";
  }
  constexpr std::array<Place, 2> places{{{"ROBOTRACONTEUR_USER_RUN_DIR", ""}, {"XDG_RUNTIME_DIR", "robotraconteur"}}};
  return first_of(places, "/tmp/robotraconteur-run-" + std::to_string(::getuid()));
}

bool is_own_folder(const fs::path& folder) {
  struct stat status {};
  return ::lstat(folder.c_str(), &status) == 0 && S_ISDIR(status.st_mode) && status.st_uid == ::geteuid();
}

Result<fs::path> make_user_run_folder() {
  const auto run = user_run_folder();
  if (!run) return run;
  std::error_code error;
  if (fs::create_directories(*run, error)) fs::permissions(*run, fs::perms::owner_all, error);
  if (error) return make_error(ErrorCode::system_resource_error, "create " + run->string() + ": " + error.message());
  if (!is_own_folder(*run))
    return make_error(ErrorCode::system_resource_permission_denied,
                      run->string() + " belongs to another user or is a link, expected a folder of this user's");
  return run;
}

std::string user_name() {
  std::vector<char> buffer(16 * 1024);
  passwd entry{};
  passwd* found = nullptr;
  if (::getpwuid_r(::geteuid(), &entry, buffer.data(), buffer.size(), &found) != 0 || found == nullptr) return {};
  return entry.pw_name;
}

}  // namespace rr
