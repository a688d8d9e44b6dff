// Certificates for tests: good ones, and all ways to be bad. Test support.
#pragma once

#include <stdexcept>

#include "core/session/start_tls.hpp"
#include "node/tls/issue_certificates.hpp"
#include "node/tls/node_certificate_check.hpp"
#include "node/tls/tls_context.hpp"
#include "test/support/folder.hpp"

namespace rr::test {

inline constexpr std::int64_t one_day = 24 * 3600;
inline constexpr NodeId service_node{{0x11, 0x11, 0x11, 0x11, 2}};
inline constexpr NodeId client_node{{0xaa, 0xaa, 0xaa, 0xaa, 1}};

inline CertificateWish ca_wish(std::string name = "Lab CA", std::string oid = root_oid) {
  CertificateWish wish;
  wish.common_name = std::move(name);
  wish.node_level_oid = std::move(oid);
  wish.is_ca = true;
  wish.begins_after_seconds = -2 * one_day;
  wish.ends_after_seconds = one_day;
  return wish;
}

inline CertificateWish node_wish(const NodeId& id = service_node) {
  CertificateWish wish;
  wish.common_name = format_certificate_name(id);
  wish.node_level_oid = node_oid;
  wish.begins_after_seconds = -one_day;
  wish.ends_after_seconds = one_day;
  return wish;
}

inline CertificateAndKey issue(const CertificateWish& wish, const CertificateAndKey* ca) {
  auto made = issue_certificate(wish, ca);
  if (!made) throw std::runtime_error(made.error().message);
  return *made;
}

/// A CA and what it has issued, in files.
class CertificateLab {
 public:
  CertificateLab() : ca(issue(ca_wish(), nullptr)) { folder_.write("ca.pem", ca.certificate); }

  const CertificateAndKey ca;

  TlsTrust trust() const { return {{folder_.path("ca.pem")}, {}, {}}; }
  std::string bundle(const CertificateAndKey& node, const std::string& chain = {}) {
    const auto bytes = make_node_bundle(node, chain).value();
    return folder_.write("node" + std::to_string(++count_) + ".p12", as_text(bytes));
  }
  NodeTlsOptions good(const NodeId& id) { return {bundle(issue(node_wish(id), &ca)), id, trust()}; }
  TlsContextPtr context(const NodeTlsOptions& options) const {
    auto made = make_node_tls(options);
    if (!made) throw std::runtime_error(made.error().message);
    return *made;
  }
  /// For clients without a certificate.
  TlsContextPtr anonymous() const { return context({{}, {}, trust()}); }
  const rrgate::test::Folder& folder() const { return folder_; }

 private:
  rrgate::test::Folder folder_;
  int count_ = 0;
};

}  // namespace rr::test
