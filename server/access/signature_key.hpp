// Keys that check signatures, one algorithm each: what JSON Web Tokens are signed with. Layer: server/access.
// Source: RFC 7518 sections 3.2, 3.3, 3.4; RFC 8037 section 3.1.
#pragma once

#include <cstdint>
#include <memory>
#include <string_view>

#include "core/support/bytes.hpp"
#include "core/support/error.hpp"

struct evp_pkey_st;

namespace rr {

enum class SignatureAlgorithm : std::uint8_t { hs256, rs256, es256, eddsa };

/// A key is of one algorithm for good: a token can't have it taken for another's. Numbers are big-endian.
class SignatureKey {
 public:
  /// HMAC with SHA-256. Errors   invalid_argument: fewer than 32 bytes, which could be guessed from one token.
  static Result<SignatureKey> from_secret(ByteSpan secret);
  /// RSASSA-PKCS1-v1_5 with SHA-256. Errors   invalid_argument: not 2048 to 8192 bits, or no such key.
  static Result<SignatureKey> from_rsa(ByteSpan modulus, ByteSpan exponent);
  /// ECDSA with P-256 and SHA-256. Errors   invalid_argument: not two numbers of 32 bytes, or no point of the curve.
  static Result<SignatureKey> from_p256(ByteSpan x, ByteSpan y);
  /// Ed25519. Errors   invalid_argument: not 32 bytes.
  static Result<SignatureKey> from_ed25519(ByteSpan key);

  SignatureAlgorithm algorithm() const { return algorithm_; }
  bool verifies(std::string_view text, ByteSpan signature) const;

 private:
  SignatureKey() = default;

  SignatureAlgorithm algorithm_ = SignatureAlgorithm::hs256;
  Bytes secret_ = {};
  std::shared_ptr<evp_pkey_st> key_ = {};
};

}  // namespace rr
