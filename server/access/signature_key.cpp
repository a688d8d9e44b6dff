#include "server/access/signature_key.hpp"

#include <openssl/core_names.h>
#include <openssl/ecdsa.h>
#include <openssl/param_build.h>

#include "node/tls/digest.hpp"
#include "node/tls/openssl.hpp"

namespace rr {

namespace {

constexpr std::size_t smallest_secret = 32;
constexpr int smallest_rsa_bits = 2048;
constexpr int largest_rsa_bits = 8192;   // larger ones take their time with every token
constexpr std::size_t number_size = 32;  // of P-256

using Number = std::unique_ptr<BIGNUM, openssl::Free<BN_free>>;
using ParameterBuilder = std::unique_ptr<OSSL_PARAM_BLD, openssl::Free<OSSL_PARAM_BLD_free>>;
using Parameters = std::unique_ptr<OSSL_PARAM, openssl::Free<OSSL_PARAM_free>>;
using KeyContext = std::unique_ptr<EVP_PKEY_CTX, openssl::Free<EVP_PKEY_CTX_free>>;
using DigestContext = std::unique_ptr<EVP_MD_CTX, openssl::Free<EVP_MD_CTX_free>>;
using EcdsaSignature = std::unique_ptr<ECDSA_SIG, openssl::Free<ECDSA_SIG_free>>;

Error refused(std::string why) {
  ERR_clear_error();
  return make_error(ErrorCode::invalid_argument, std::move(why));
}

Number number_of(ByteSpan bytes) {
  return Number(BN_bin2bn(bytes.data(), static_cast<int>(bytes.size()), nullptr));
}

/// Null where OpenSSL takes it for no key.
std::shared_ptr<EVP_PKEY> make_key(const char* type, OSSL_PARAM_BLD* builder) {
  const Parameters parameters(OSSL_PARAM_BLD_to_param(builder));
  const KeyContext context(EVP_PKEY_CTX_new_from_name(nullptr, type, nullptr));
  EVP_PKEY* made = nullptr;
  if (!parameters || !context || EVP_PKEY_fromdata_init(context.get()) != 1 ||
      EVP_PKEY_fromdata(context.get(), &made, EVP_PKEY_PUBLIC_KEY, parameters.get()) != 1)
    return nullptr;
  std::shared_ptr<EVP_PKEY> key(made, EVP_PKEY_free);
  const KeyContext check(EVP_PKEY_CTX_new_from_pkey(nullptr, made, nullptr));
  return check && EVP_PKEY_public_check(check.get()) == 1 ? key : nullptr;
}

/// JSON Web Tokens have the two numbers side by side, OpenSSL wants them in DER. Empty: no such signature.
Bytes to_der(ByteSpan signature) {
  if (signature.size() != 2 * number_size) return {};
  const EcdsaSignature pair(ECDSA_SIG_new());
  auto r = number_of(signature.first(number_size));
  auto s = number_of(signature.subspan(number_size));
  if (!pair || ECDSA_SIG_set0(pair.get(), r.get(), s.get()) != 1) return {};
  r.release();
  s.release();
  unsigned char* der = nullptr;
  const int size = i2d_ECDSA_SIG(pair.get(), &der);
  const openssl::Text owner(der);
  return size > 0 ? Bytes(der, der + size) : Bytes();
}

}  // namespace

Result<SignatureKey> SignatureKey::from_secret(ByteSpan secret) {
  if (secret.size() < smallest_secret)
    return refused("the secret has " + std::to_string(secret.size()) + " bytes, expected at least 32");
  SignatureKey out;
  out.secret_.assign(secret.begin(), secret.end());
  return out;
}

Result<SignatureKey> SignatureKey::from_rsa(ByteSpan modulus, ByteSpan exponent) {
  if (modulus.size() > largest_rsa_bits / 8 || exponent.size() > 8) return refused("an RSA key beyond 8192 bits");
  const auto n = number_of(modulus);
  const auto e = number_of(exponent);
  if (BN_num_bits(n.get()) < smallest_rsa_bits)
    return refused("an RSA key of " + std::to_string(BN_num_bits(n.get())) + " bits, expected at least 2048");
  const ParameterBuilder builder(OSSL_PARAM_BLD_new());
  SignatureKey out;
  out.algorithm_ = SignatureAlgorithm::rs256;
  if (OSSL_PARAM_BLD_push_BN(builder.get(), OSSL_PKEY_PARAM_RSA_N, n.get()) == 1 &&
      OSSL_PARAM_BLD_push_BN(builder.get(), OSSL_PKEY_PARAM_RSA_E, e.get()) == 1)
    out.key_ = make_key("RSA", builder.get());
  if (!out.key_) return refused("n and e are no RSA key");
  return out;
}

Result<SignatureKey> SignatureKey::from_p256(ByteSpan x, ByteSpan y) {
  if (x.size() != number_size || y.size() != number_size) return refused("x and y of P-256 have 32 bytes each");
  Bytes point{4};  // uncompressed
  point.insert(point.end(), x.begin(), x.end());
  point.insert(point.end(), y.begin(), y.end());
  const ParameterBuilder builder(OSSL_PARAM_BLD_new());
  SignatureKey out;
  out.algorithm_ = SignatureAlgorithm::es256;
  if (OSSL_PARAM_BLD_push_utf8_string(builder.get(), OSSL_PKEY_PARAM_GROUP_NAME, "prime256v1", 0) == 1 &&
      OSSL_PARAM_BLD_push_octet_string(builder.get(), OSSL_PKEY_PARAM_PUB_KEY, point.data(), point.size()) == 1)
    out.key_ = make_key("EC", builder.get());
  if (!out.key_) return refused("x and y are no point of P-256");
  return out;
}

Result<SignatureKey> SignatureKey::from_ed25519(ByteSpan key) {
  SignatureKey out;
  out.algorithm_ = SignatureAlgorithm::eddsa;
  if (auto* made = EVP_PKEY_new_raw_public_key(EVP_PKEY_ED25519, nullptr, key.data(), key.size()))
    out.key_.reset(made, EVP_PKEY_free);
  if (!out.key_) return refused("an Ed25519 key has 32 bytes, found " + std::to_string(key.size()));
  return out;
}

bool SignatureKey::verifies(std::string_view text, ByteSpan signature) const {
  const auto bytes = as_bytes(text);
  if (algorithm_ == SignatureAlgorithm::hs256) return equal_secrets(hmac_sha256(secret_, bytes), signature);
  Bytes der;
  if (algorithm_ == SignatureAlgorithm::es256) {
    der = to_der(signature);
    if (der.empty()) return false;
    signature = der;
  }
  const DigestContext context(EVP_MD_CTX_new());
  const auto* digest = algorithm_ == SignatureAlgorithm::eddsa ? nullptr : EVP_sha256();
  const bool is_right =
      context && EVP_DigestVerifyInit(context.get(), nullptr, digest, nullptr, key_.get()) == 1 &&
      EVP_DigestVerify(context.get(), signature.data(), signature.size(), bytes.data(), bytes.size()) == 1;
  ERR_clear_error();
  return is_right;
}

}  // namespace rr
