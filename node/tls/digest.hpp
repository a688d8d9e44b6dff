// Digests and random bytes. Layer: node/tls.
#pragma once

#include <cstddef>
#include <string>

#include "core/support/bytes.hpp"

namespace rr {

/// 20 bytes. For protocols that ask for it, not for secrets.
Bytes sha1(ByteSpan bytes);
/// 32 bytes.
Bytes sha256(ByteSpan bytes);
/// 32 bytes. Source: RFC 2104.
Bytes hmac_sha256(ByteSpan key, ByteSpan bytes);
/// For secrets. Throws   std::runtime_error: the system has none to give.
Bytes random_bytes(std::size_t count);
/// Takes the same time whatever differs; texts of different length are no secret.
bool equal_secrets(ByteSpan left, ByteSpan right);

}  // namespace rr
