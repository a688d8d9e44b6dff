// Certificates of one's own: CAs, nodes, web servers. Layer: node/tls. Source: transports spec section 5.3.
#pragma once

#include <string>
#include <vector>

#include "core/support/bytes.hpp"
#include "core/support/error.hpp"
#include "core/support/node_id.hpp"

namespace rr {

/// A certificate and its key, both PEM. The key is secret.
struct CertificateAndKey {
  std::string certificate;
  std::string key;
};

struct CertificateWish {
  std::string common_name;
  std::string node_level_oid = {};  ///< the critical extension of section 5.3; empty: none
  bool is_ca = false;
  std::vector<std::string> hosts = {};    ///< DNS names ("*.lab.example" too) and IP addresses of a web server
  std::int64_t begins_after_seconds = 0;  ///< from now; less than 0: in the past
  std::int64_t ends_after_seconds = 0;    ///< from now
};

/// Makes a key (ECDSA, P-256) and the certificate of it. `issuer` null: self-signed.
/// Errors   invalid_argument: a name or issuer that can't be used; internal_error with OpenSSL's words.
[[nodiscard]] Result<CertificateAndKey> issue_certificate(const CertificateWish& wish, const CertificateAndKey* issuer);

/// The file that a node loads: PKCS#12 with an empty password. `chain`: PEM certificates of the CAs between node and
/// root, the root may be among them.
[[nodiscard]] Result<Bytes> make_node_bundle(const CertificateAndKey& node, const std::string& chain);

}  // namespace rr
