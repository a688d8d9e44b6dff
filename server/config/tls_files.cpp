#include "server/config/tls_files.hpp"

#include "node/platform/file_look.hpp"
#include "node/tls/certificate_files.hpp"
#include "server/log/log.hpp"

namespace rrgate {

TlsFiles TlsFiles::of_https(DeviceTls device) {
  TlsFiles out(std::move(device));
  out.is_of_https_ = true;
  return out;
}

rr::TlsTrust TlsFiles::trust() const {
  if (device_.ca.empty()) return is_of_https_ ? rr::TlsTrust() : rr::default_trust();
  rr::TlsTrust trust;
  trust.files = device_.ca;
  return trust;
}

TlsFiles::Looks TlsFiles::look() const {
  Looks looks;
  const auto add = [&looks](const std::string& file) { looks[file] = rr::file_look(file); };
  for (const auto& certificate : certificates_) {
    add(certificate.certificate_file);
    add(certificate.key_file);
  }
  for (const auto* files : {&clients_.ca, &clients_.crl})
    for (const auto& file : *files) add(file);
  if (!certificates_.empty()) return looks;
  const auto trusted = trust();
  for (const auto* files : {&trusted.files, &trusted.directories, &trusted.published_roots})
    for (const auto& file : *files) add(file);
  return looks;
}

rr::Result<> TlsFiles::load() {
  seen_ = look();  // before reading: what changes meanwhile is seen at the next look
  auto made = make();
  if (!made) return made.error();
  context_ = std::move(*made);
  return {};
}

rr::Result<rr::TlsContextPtr> TlsFiles::make() const {
  if (!certificates_.empty()) return rr::make_web_tls(certificates_, clients_);
  if (is_of_https_) return rr::make_web_client_tls(trust());
  rr::NodeTlsOptions device;
  device.trust = trust();
  return rr::make_node_tls(device);
}

bool TlsFiles::reload() {
  const auto loaded = load();
  if (loaded)
    log(LogLevel::info, "TLS files read anew", {{"files", seen_.size()}});
  else
    log(LogLevel::error, "TLS files can't be used; those from before stay in use", {{"error", loaded.error().message}});
  return loaded.has_value();
}

std::shared_ptr<TlsFiles> make_device_tls(const DeviceConfig& device) {
  return has_node_tls(device.url) ? std::make_shared<TlsFiles>(device.tls) : nullptr;
}

std::shared_ptr<TlsFiles> make_device_https(const DeviceConfig& device) {
  if (!has_https(device.url)) return nullptr;
  // Of the two, TLS between the nodes has the CAs of the configuration.
  return std::make_shared<TlsFiles>(TlsFiles::of_https(has_node_tls(device.url) ? DeviceTls() : device.tls));
}

}  // namespace rrgate
