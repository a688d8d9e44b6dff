// Base64 for URLs, without padding. Layer: server/access. Source: RFC 4648 section 5.
#pragma once

#include <algorithm>

#include "node/tls/base64.hpp"

namespace rrgate {

inline std::string encode_base64url(rr::ByteSpan bytes) {
  auto out = rr::encode_base64(bytes);
  std::replace(out.begin(), out.end(), '+', '-');
  std::replace(out.begin(), out.end(), '/', '_');
  out.resize(std::min(out.find('='), out.size()));
  return out;
}

/// Strict, as rr::decode_base64().
inline std::optional<rr::Bytes> decode_base64url(std::string_view text) {
  if (text.find_first_of("+/=") != std::string_view::npos) return std::nullopt;
  std::string standard(text);
  std::replace(standard.begin(), standard.end(), '-', '+');
  std::replace(standard.begin(), standard.end(), '_', '/');
  standard.resize((standard.size() + 3) / 4 * 4, '=');
  return rr::decode_base64(standard);
}

}  // namespace rrgate
