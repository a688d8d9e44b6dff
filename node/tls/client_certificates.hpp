// HTTPS whose clients may show certificates too. Layer: node/tls.
#pragma once

#include "node/tls/tls_context.hpp"

namespace rr {

/// As make_web_tls(), the server's role; but clients are asked for a certificate, which they may have or not.
/// `client_ca`  PEM files of the CAs that may have certified them; empty: they are not asked.
[[nodiscard]] Result<TlsContextPtr> make_web_tls(std::span<const WebCertificate> certificates,
                                                 std::span<const std::string> client_ca);

}  // namespace rr
