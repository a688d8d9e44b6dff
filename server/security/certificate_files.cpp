#include "server/security/certificate_files.hpp"

#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>

namespace rr {

namespace {

/// Empty where it is not set.
std::string environment(const char* name) {
  const char* const value = std::getenv(name);
  return value ? value : "";
}

Result<std::string> absolute(const char* variable, const std::string& value, const char* below = "") {
  std::filesystem::path path = value;
  if (!path.is_absolute())
    return make_error(ErrorCode::invalid_configuration,
                      std::string(variable) + " is " + quoted(value, 200) + ", expected an absolute path");
  return (*below ? path / below : path).string();
}

}  // namespace

Result<std::string> user_config_folder() {
  if (::geteuid() == 0) {
    constexpr auto variable = "ROBOTRACONTEUR_SYSTEM_CONFIG_DIR";
    if (const auto folder = environment(variable); !folder.empty()) return absolute(variable, folder);
    const auto prefix = environment("ROBOTRACONTEUR_SYSTEM_PREFIX");
    return prefix + "/etc/robotraconteur";
  }
  struct Place {
    const char* variable;
    const char* below;
  };
  constexpr Place places[] = {
      {"ROBOTRACONTEUR_USER_CONFIG_DIR", ""},
      {"ROBOTRACONTEUR_USER_HOME", ".config/RobotRaconteur"},
      {"XDG_CONFIG_HOME", "RobotRaconteur"},
      {"HOME", ".config/RobotRaconteur"},
  };
  for (const auto& place : places)
    if (const auto folder = environment(place.variable); !folder.empty())
      return absolute(place.variable, folder, place.below);
  return make_error(ErrorCode::invalid_configuration, "no folder for Robot Raconteur's files: HOME is not set");
}

Result<std::string> node_certificate_path(const NodeId& id) {
  const auto folder = user_config_folder();
  if (!folder) return folder.error();
  return *folder + "/certificates/" + format_node_id(id) + ".p12";
}

Result<TlsContextPtr> load_node_tls(const NodeId& id) {
  NodeTlsOptions options;
  auto file = node_certificate_path(id);
  if (!file) return file.error();
  options.certificate_file = std::move(*file);
  options.id = id;
  options.trust = default_trust();
  return make_node_tls(options);
}

TlsTrust default_trust() {
  TlsTrust trust;
  if (auto file = environment("ROBOTRACONTEUR_SSL_CERT_FILE"); !file.empty()) trust.files.push_back(std::move(file));
  if (auto folder = environment("ROBOTRACONTEUR_SSL_CERT_DIR"); !folder.empty())
    trust.directories.push_back(std::move(folder));
  const auto no_roots = environment("ROBOTRACONTEUR_NO_DEFAULT_ROOT_CERT");
  const auto folder = user_config_folder();
  if (no_roots == "true" || no_roots == "1" || !folder) return trust;
  std::error_code error;
  for (const auto& entry :
       std::filesystem::directory_iterator(std::filesystem::path(*folder) / "certificates" / "roots", error))
    if (const auto extension = entry.path().extension(); extension == ".pem" || extension == ".crt")
      trust.published_roots.push_back(entry.path().string());
  std::sort(trust.published_roots.begin(), trust.published_roots.end());
  return trust;
}

}  // namespace rr
