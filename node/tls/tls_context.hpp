// What one side brings to TLS: certificate and key, whom it trusts, versions and ciphers. Layer: node/tls.
// Source: transports spec sections 5.2, 5.3, 5.4.
#pragma once

#include <memory>
#include <span>
#include <string>
#include <vector>

#include "core/support/error.hpp"
#include "core/support/node_id.hpp"

struct ssl_ctx_st;

namespace rr {

/// What was found out about the peer of one connection. The check of node certificates fills it in.
struct PeerCheck {
  NodeId expected = {};  ///< any: whichever node the certificate is of
  NodeId found = {};     ///< any: no certificate was shown
  std::string problem = {};
};

/// Never changes once made, and shared by all its connections. TLS 1.2 and 1.3 with forward secrecy and authenticated
/// encryption; no compression, no renegotiation.
class TlsContext {
 public:
  /// Takes over the objects. The first is the default; the others are chosen by the name that a client asks for.
  TlsContext(std::vector<ssl_ctx_st*> native, bool has_certificate, bool checks_nodes);
  TlsContext(const TlsContext&) = delete;
  TlsContext& operator=(const TlsContext&) = delete;
  ~TlsContext();

  ssl_ctx_st* native() const { return native_.front(); }
  const std::vector<ssl_ctx_st*>& all() const { return native_; }
  bool has_certificate() const { return has_certificate_; }
  /// Certificates of peers are those of nodes, and PeerCheck says of which.
  bool checks_nodes() const { return checks_nodes_; }
  /// Whether one of the certificates is for a host of this name.
  bool has_name(const std::string& host) const;

 private:
  std::vector<ssl_ctx_st*> native_;
  bool has_certificate_;
  bool checks_nodes_;
};
using TlsContextPtr = std::shared_ptr<const TlsContext>;

/// CAs to believe.
struct TlsTrust {
  std::vector<std::string> files = {};            ///< PEM, any number of certificates each
  std::vector<std::string> directories = {};      ///< named as OpenSSL's rehash does
  std::vector<std::string> published_roots = {};  ///< PEM files, of which only the roots that the Robot Raconteur
                                                  ///< project has published are taken, told by their SHA-256
  bool operator==(const TlsTrust&) const = default;
};

/// TLS between nodes, both roles.
struct NodeTlsOptions {
  /// PKCS#12 with an empty password: key, certificate, intermediate CAs. Empty: none, for clients alone.
  std::string certificate_file = {};
  NodeId id = {};  ///< the node that the certificate must be of
  TlsTrust trust = {};
};
/// Errors   invalid_configuration: a file that can't be read or used, with its name and what is wrong; a certificate of
///          another node or that has expired.
[[nodiscard]] Result<TlsContextPtr> make_node_tls(const NodeTlsOptions& options);

/// A certificate for HTTPS, PEM: certificate and intermediate CAs in one file, the key in the other.
struct WebCertificate {
  std::string certificate_file;
  std::string key_file;
  bool operator==(const WebCertificate&) const = default;
};
/// HTTPS, the client's role: servers are checked by host name, against `trust` or, where that is empty, what this
/// system trusts (SSL_CERT_FILE is heeded). Errors   invalid_configuration, as above.
[[nodiscard]] Result<TlsContextPtr> make_web_client_tls(const TlsTrust& trust);

/// HTTPS, the server's role. The first certificate whose names fit what the client asks for is used, else the first.
/// Errors   invalid_configuration, as above.
[[nodiscard]] Result<TlsContextPtr> make_web_tls(std::span<const WebCertificate> certificates);

}  // namespace rr
