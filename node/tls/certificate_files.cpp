#include "node/tls/certificate_files.hpp"

#include <algorithm>
#include <cstdlib>
#include <filesystem>

#include "node/platform/folders.hpp"

namespace rr {

namespace {

/// Empty where it is not set.
std::string environment(const char* name) {
  const char* const value = std::getenv(name);
  return value ? value : "";
}

}  // namespace

Result<std::string> node_certificate_path(const NodeId& id) {
  const auto folder = user_config_folder();
  if (!folder) return folder.error();
  return (*folder / "certificates" / (format_node_id(id) + ".p12")).string();
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
  for (const auto& entry : std::filesystem::directory_iterator(*folder / "certificates" / "roots", error))
    if (const auto extension = entry.path().extension(); extension == ".pem" || extension == ".crt")
      trust.published_roots.push_back(entry.path().string());
  std::sort(trust.published_roots.begin(), trust.published_roots.end());
  return trust;
}

}  // namespace rr
