#include "node/tls/base64.hpp"

#include <openssl/evp.h>

namespace rr {

std::string encode_base64(ByteSpan bytes) {
  std::string out(4 * ((bytes.size() + 2) / 3), '\0');  // and the '\0' that OpenSSL puts behind it
  EVP_EncodeBlock(reinterpret_cast<unsigned char*>(out.data()), bytes.data(), static_cast<int>(bytes.size()));
  return out;
}

std::optional<Bytes> decode_base64(std::string_view text) {
  if (text.size() % 4 != 0) return std::nullopt;
  Bytes out(text.size() / 4 * 3);
  const auto* const input = reinterpret_cast<const unsigned char*>(text.data());
  if (EVP_DecodeBlock(out.data(), input, static_cast<int>(text.size())) < 0) return std::nullopt;
  if (text.ends_with('=')) out.resize(out.size() - (text.ends_with("==") ? 2 : 1));
  // OpenSSL takes other spellings of the same bytes; here there is one.
  if (encode_base64(out) != text) return std::nullopt;
  return out;
}

}  // namespace rr
