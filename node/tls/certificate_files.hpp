// Where the reference keeps certificates, and whom it trusts. Layer: node/tls. Source: transports spec sections 5.3,
// 8.1.
#pragma once

#include <string>

#include "node/tls/tls_context.hpp"

namespace rr {

/// The certificate of a node, whether it is there or not: certificates/{id}.p12 in user_config_folder().
[[nodiscard]] Result<std::string> node_certificate_path(const NodeId& id);

/// What the node `id` needs for TLS: its certificate, which must be there, and default_trust().
/// Errors   those of make_node_tls() and user_config_folder().
[[nodiscard]] Result<TlsContextPtr> load_node_tls(const NodeId& id);

/// What ROBOTRACONTEUR_SSL_CERT_FILE and ROBOTRACONTEUR_SSL_CERT_DIR name, and the published roots that were put into
/// certificates/roots of user_config_folder() (*.pem, *.crt) unless ROBOTRACONTEUR_NO_DEFAULT_ROOT_CERT is true.
TlsTrust default_trust();

}  // namespace rr
