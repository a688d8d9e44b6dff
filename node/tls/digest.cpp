#include "node/tls/digest.hpp"

#include <openssl/crypto.h>
#include <openssl/evp.h>
#include <openssl/rand.h>

#include <stdexcept>

namespace rr {

namespace {

Bytes digest(const char* name, ByteSpan bytes) {
  Bytes out(EVP_MAX_MD_SIZE);
  std::size_t size = 0;
  if (EVP_Q_digest(nullptr, name, nullptr, bytes.data(), bytes.size(), out.data(), &size) != 1)
    throw std::runtime_error(std::string("OpenSSL refused ") + name);
  out.resize(size);
  return out;
}

}  // namespace

Bytes sha1(ByteSpan bytes) {
  return digest("SHA1", bytes);
}

Bytes sha256(ByteSpan bytes) {
  return digest("SHA256", bytes);
}

Bytes hmac_sha256(ByteSpan key, ByteSpan bytes) {
  Bytes out(EVP_MAX_MD_SIZE);
  std::size_t size = 0;
  if (!EVP_Q_mac(nullptr, "HMAC", nullptr, "SHA256", nullptr, key.data(), key.size(), bytes.data(), bytes.size(),
                 out.data(), out.size(), &size))
    throw std::runtime_error("OpenSSL refused HMAC");
  out.resize(size);
  return out;
}

Bytes random_bytes(std::size_t count) {
  Bytes out(count);
  if (RAND_bytes(out.data(), static_cast<int>(count)) != 1) throw std::runtime_error("OpenSSL has no random bytes");
  return out;
}

bool equal_secrets(ByteSpan left, ByteSpan right) {
  return left.size() == right.size() && CRYPTO_memcmp(left.data(), right.data(), left.size()) == 0;
}

}  // namespace rr
