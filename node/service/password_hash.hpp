// Passwords as files keep them: scrypt, and the unsalted MD5 of the reference's files. Layer: node/service.
// Source: sessions spec section 2.15; RFC 7914; the PHC string format for the text.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "core/support/error.hpp"

namespace rr {

enum class PasswordScheme : std::uint8_t { scrypt, md5 };

/// The cost of scrypt: memory is 128 * r * 2^ln bytes, time grows with p. Of the costs that OWASP's "Password Storage
/// Cheat Sheet" holds for equal and sufficient, this one has strangers take 16 MB.
struct ScryptCost {
  std::uint32_t ln = 14;
  std::uint32_t r = 8;
  std::uint32_t p = 5;
};

/// A stored password: what is left of it, and enough to check one.
class PasswordHash {
 public:
  /// "$scrypt$ln=14,r=8,p=5$SALT$HASH" (base64 without padding), or 32 lower-case hex digits (MD5).
  /// Errors   invalid_argument: neither form, or a cost above 1 GiB of memory. The text is not repeated.
  static Result<PasswordHash> parse(std::string_view text);
  /// With a new random salt.
  /// Errors   internal_error: OpenSSL refused.
  static Result<PasswordHash> make_scrypt(std::string_view password, ScryptCost cost = {});

  /// Takes the time of a whole hash, whatever differs; false also where OpenSSL refuses.
  bool matches(std::string_view password) const;
  std::string text() const;
  PasswordScheme scheme() const { return scheme_; }

 private:
  PasswordScheme scheme_ = PasswordScheme::md5;
  ScryptCost cost_ = {};
  std::string salt_;  // bytes
  std::string hash_;  // bytes
};

}  // namespace rr
