// Base64 with padding. Layer: node/tls. Source: RFC 4648 section 4.
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "core/support/bytes.hpp"

namespace rr {

std::string encode_base64(ByteSpan bytes);

/// Strict: the standard alphabet, padding, no blanks, unused bits zero. nullopt for anything else.
std::optional<Bytes> decode_base64(std::string_view text);

}  // namespace rr
