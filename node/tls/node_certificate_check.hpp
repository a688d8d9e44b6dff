// Whether a peer is the node that it says to be. Layer: node/tls. Source: transports spec section 5.3.
#pragma once

#include "core/support/error.hpp"
#include "core/support/node_id.hpp"

struct stack_st_X509;
struct x509_store_ctx_st;

namespace rr {

/// Checks the chain of a peer: as any chain, then that each certificate is marked for its level (root, intermediate,
/// node) by a critical extension and has no other critical one that is unknown, and the subject.
/// Returns  the node that the certificate is of.
/// Errors   authentication_error: which certificate fails which check.
Result<NodeId> check_node_chain(x509_store_ctx_st* store);
/// The part of it that follows the checks of any chain. `chain`: the peer's certificate first, the root last.
Result<NodeId> read_node_chain(const stack_st_X509* chain);

/// The object identifiers that mark the levels.
inline constexpr const char* root_oid = "1.3.6.1.4.1.45455.1.1.3.1";
inline constexpr const char* intermediate_oid = "1.3.6.1.4.1.45455.1.1.3.2";
inline constexpr const char* node_oid = "1.3.6.1.4.1.45455.1.1.3.3";

}  // namespace rr
