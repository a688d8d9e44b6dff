// JSON Web Tokens: who somebody is, signed by whoever the operator believes. Layer: server/access.
// Source: RFC 7515, 7517, 7518, 7519, 8037, and the advice of RFC 8725.
#pragma once

#include <chrono>
#include <string>
#include <string_view>
#include <vector>

#include "server/access/identity.hpp"
#include "server/access/signature_key.hpp"

namespace rrgate {

/// What a token must say, and where it says who somebody is.
struct JwtClaims {
  std::string issuer = {};    ///< "iss"; empty: any
  std::string audience = {};  ///< one of "aud"; empty: any
  std::string user_claim = "sub";
  std::string roles_claim = "roles";  ///< an array, or words in a text; "realm_access.roles" is a claim in a claim

  bool operator==(const JwtClaims&) const = default;
};

/// Checks tokens. The key says the algorithm, never the token alone. Never changes once made.
class JwtVerifier {
 public:
  /// RS256, ES256, EdDSA (Ed25519) and, for "oct" keys, HS256. Keys of other kinds or uses are passed over.
  /// Errors   invalid_configuration: no JSON Web Key Set, or none of its keys can be used; what is wrong with which.
  static rr::Result<JwtVerifier> from_jwks(std::string_view text, JwtClaims claims);
  /// What everybody may read: secrets in it ("oct") are none. Errors   as above.
  static rr::Result<JwtVerifier> from_published(std::string_view text, JwtClaims claims);
  /// Refuses each token.
  static JwtVerifier without_keys(JwtClaims claims) { return JwtVerifier(std::move(claims)); }
  /// HS256. White space at the end of the text does not count.
  /// Errors   invalid_configuration: fewer than 32 bytes.
  static rr::Result<JwtVerifier> from_secret(std::string_view text, JwtClaims claims);

  /// Name and roles. A token must have "exp"; clocks may differ by half a minute.
  /// Errors   authentication_error: why it is refused, for the client.
  rr::Result<Identity> verify(std::string_view token, std::chrono::system_clock::time_point now) const;

  /// Whether it still judges tokens as it did when it made an identity of one: by the same key, of the same issuer, by
  /// the same claims. `credential`  of that identity.
  bool knows(std::string_view credential) const;
  /// Whether the token names a key that is not here: its issuer may have a new one.
  bool misses_key_of(std::string_view token) const;
  std::size_t key_count() const { return keys_.size(); }

 private:
  struct Key {
    std::string id;
    rr::SignatureKey key;
    std::string credential;  ///< of identities whose tokens it has signed
  };
  explicit JwtVerifier(JwtClaims claims) : claims_(std::move(claims)) {}
  void add(std::string id, rr::SignatureKey key, rr::ByteSpan material);
  /// Returns the key that has signed it.
  rr::Result<const Key*> check_signature(std::string_view signed_part, std::string_view header,
                                         rr::ByteSpan signature) const;

  JwtClaims claims_;
  Proof proof_ = Proof::jwt;
  std::vector<Key> keys_;
};

/// Whether it looks like one: three parts with dots between.
bool looks_like_jwt(std::string_view text);

}  // namespace rrgate
