// A TLS context that follows its files. Layer: server/config.
#pragma once

#include <map>
#include <memory>
#include <string>
#include <vector>

#include "node/tls/client_certificates.hpp"
#include "server/config/config.hpp"

namespace rrgate {

/// Certificates are renewed while the gateway runs: a new context is made when a file changes, and new connections use
/// it. Files that can't be used change nothing.
class TlsFiles {
 public:
  /// For HTTPS.
  /// `clients`  whose certificates may be shown.
  explicit TlsFiles(std::vector<rr::WebCertificate> certificates, rr::ClientTrust clients = {})
      : certificates_(std::move(certificates)), clients_(std::move(clients)) {}
  /// For connections to a device. Without CAs: default_trust().
  explicit TlsFiles(DeviceTls device) : device_(std::move(device)) {}
  /// For HTTPS to a device. Without CAs: those that the system trusts.
  static TlsFiles of_https(DeviceTls device);

  /// Errors   those of make_web_tls() and make_node_tls(); then context() stays as it was.
  [[nodiscard]] rr::Result<> load();
  /// Whether a file is another one than at the last load().
  bool has_changed() const { return look() != seen_; }
  /// load(), and a line in the log about how it went. Returns whether it went well.
  bool reload();

  const rr::TlsContextPtr& context() const { return context_; }

 private:
  /// Of each file what tells that it was changed or replaced.
  using Looks = std::map<std::string, std::string>;
  rr::TlsTrust trust() const;
  rr::Result<rr::TlsContextPtr> make() const;
  Looks look() const;

  std::vector<rr::WebCertificate> certificates_;
  rr::ClientTrust clients_;
  DeviceTls device_;
  bool is_of_https_ = false;  ///< and of a client's role
  Looks seen_;
  rr::TlsContextPtr context_;
};

/// For connections to a device: of TLS between nodes, and of HTTPS around that. Null where its URL wants none.
std::shared_ptr<TlsFiles> make_device_tls(const DeviceConfig& device);
std::shared_ptr<TlsFiles> make_device_https(const DeviceConfig& device);

}  // namespace rrgate
