// Makes keys and tokens, as an issuer does.
#pragma once

#include <openssl/core_names.h>
#include <openssl/ecdsa.h>

#include <nlohmann/json.hpp>
#include <string>

#include "node/tls/openssl.hpp"
#include "server/access/base64url.hpp"

namespace rrgate::test {

class JwtSigner {
 public:
  /// "RS256", "ES256", "EdDSA", or "HS256" with `secret`.
  explicit JwtSigner(std::string algorithm, std::string secret = {}, unsigned rsa_bits = 2048)
      : algorithm_(std::move(algorithm)), secret_(std::move(secret)) {
    if (algorithm_ == "RS256") key_.reset(EVP_RSA_gen(rsa_bits));
    if (algorithm_ == "ES256") key_.reset(EVP_EC_gen("P-256"));
    if (algorithm_ == "EdDSA") key_.reset(EVP_PKEY_Q_keygen(nullptr, nullptr, "ED25519"));
  }

  /// The public key as a JSON Web Key, "oct" for secrets.
  nlohmann::json jwk(const std::string& kid = {}) const {
    nlohmann::json out;
    if (algorithm_ == "RS256") out = {{"kty", "RSA"}, {"n", number("n")}, {"e", number("e")}};
    if (algorithm_ == "ES256")
      out = {{"kty", "EC"}, {"crv", "P-256"}, {"x", number("qx", 32)}, {"y", number("qy", 32)}};
    if (algorithm_ == "EdDSA") {
      rr::Bytes raw(32);
      std::size_t size = raw.size();
      EVP_PKEY_get_raw_public_key(key_.get(), raw.data(), &size);
      out = {{"kty", "OKP"}, {"crv", "Ed25519"}, {"x", encode_base64url(raw)}};
    }
    if (algorithm_ == "HS256") out = {{"kty", "oct"}, {"k", encode_base64url(rr::as_bytes(secret_))}};
    if (!kid.empty()) out["kid"] = kid;
    return out;
  }

  std::string sign(const nlohmann::json& claims, nlohmann::json header = nlohmann::json::object()) const {
    if (!header.contains("alg")) header["alg"] = algorithm_;
    const auto part = [](const nlohmann::json& json) { return encode_base64url(rr::as_bytes(json.dump())); };
    return sign_text(part(header) + "." + part(claims));
  }
  std::string sign_text(const std::string& text) const { return text + "." + encode_base64url(signature(text)); }

 private:
  std::string number(const char* name, int size = 0) const {
    BIGNUM* read = nullptr;
    EVP_PKEY_get_bn_param(key_.get(), name, &read);
    const std::unique_ptr<BIGNUM, rr::openssl::Free<BN_free>> value(read);
    rr::Bytes bytes(static_cast<std::size_t>(std::max(size, BN_num_bytes(value.get()))));
    BN_bn2binpad(value.get(), bytes.data(), static_cast<int>(bytes.size()));
    return encode_base64url(bytes);
  }

  rr::Bytes signature(const std::string& text) const {
    const auto bytes = rr::as_bytes(text);
    rr::Bytes out(1024);
    std::size_t size = out.size();
    if (algorithm_ == "HS256") {
      EVP_Q_mac(nullptr, "HMAC", nullptr, "SHA256", nullptr, secret_.data(), secret_.size(), bytes.data(), bytes.size(),
                out.data(), out.size(), &size);
      out.resize(size);
      return out;
    }
    const std::unique_ptr<EVP_MD_CTX, rr::openssl::Free<EVP_MD_CTX_free>> context(EVP_MD_CTX_new());
    EVP_DigestSignInit(context.get(), nullptr, algorithm_ == "EdDSA" ? nullptr : EVP_sha256(), nullptr, key_.get());
    EVP_DigestSign(context.get(), out.data(), &size, bytes.data(), bytes.size());
    out.resize(size);
    if (algorithm_ != "ES256") return out;
    const unsigned char* at = out.data();
    const std::unique_ptr<ECDSA_SIG, rr::openssl::Free<ECDSA_SIG_free>> pair(
        d2i_ECDSA_SIG(nullptr, &at, static_cast<long>(out.size())));
    rr::Bytes both(64);
    BN_bn2binpad(ECDSA_SIG_get0_r(pair.get()), both.data(), 32);
    BN_bn2binpad(ECDSA_SIG_get0_s(pair.get()), both.data() + 32, 32);
    return both;
  }

  std::string algorithm_;
  std::string secret_;
  rr::openssl::Key key_;
};

}  // namespace rrgate::test
