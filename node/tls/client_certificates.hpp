// HTTPS whose clients may show certificates too. Layer: node/tls.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "node/tls/tls_context.hpp"

namespace rr {

/// Whose certificates clients may show.
struct ClientTrust {
  std::vector<std::string> ca = {};   ///< PEM files; empty: clients are not asked
  std::vector<std::string> crl = {};  ///< PEM files of revocation lists. Once there is one, each CA needs one that is
                                      ///< not out of date, or its certificates are refused.
  bool operator==(const ClientTrust&) const = default;
};

/// As make_web_tls(), the server's role; but clients are asked for a certificate, which they may have or not.
/// Errors   invalid_configuration: also a CA or a revocation list that can't be used.
[[nodiscard]] Result<TlsContextPtr> make_web_tls(std::span<const WebCertificate> certificates,
                                                 const ClientTrust& clients);

}  // namespace rr
