#include "server/access/jwt.hpp"

#include <algorithm>
#include <array>
#include <optional>

#include "node/tls/digest.hpp"
#include "server/access/base64url.hpp"
#include "server/json/json.hpp"

namespace rrgate {

namespace {

constexpr std::size_t max_token_size = 16 * 1024;
constexpr std::size_t max_keys = 64;
constexpr std::size_t max_roles = 256;
constexpr double clock_slack = 30;  // seconds

rr::Error refused(std::string why) {
  return rr::make_error(rr::ErrorCode::authentication_error, "token refused: " + std::move(why));
}

rr::Error unusable_key_set(std::string why) {
  return rr::make_error(rr::ErrorCode::invalid_configuration, std::move(why));
}

std::optional<rr::SignatureAlgorithm> parse_algorithm(std::string_view name) {
  if (name == "HS256") return rr::SignatureAlgorithm::hs256;
  if (name == "RS256") return rr::SignatureAlgorithm::rs256;
  if (name == "ES256") return rr::SignatureAlgorithm::es256;
  if (name == "EdDSA") return rr::SignatureAlgorithm::eddsa;
  return std::nullopt;
}

/// Empty where it is missing or no text.
std::string text_of(const rr::Json& object, const char* key) {
  const auto found = object.find(key);
  return found != object.end() && found->is_string() ? found->get<std::string>() : std::string();
}

/// What makes a key the one that it is, whatever it is called.
rr::Bytes material_of(const rr::Json& jwk) {
  rr::Json out = rr::Json::object();
  for (const auto* name : {"kty", "crv", "n", "e", "x", "y", "k"})
    if (const auto found = jwk.find(name); found != jwk.end()) out[name] = *found;
  const auto text = out.dump(-1, ' ', false, rr::Json::error_handler_t::replace);
  return rr::Bytes(text.begin(), text.end());
}

rr::Result<rr::SignatureKey> read_key(const rr::Json& jwk) {
  const auto type = text_of(jwk, "kty");
  const auto number = [&jwk](const char* name) { return decode_base64url(text_of(jwk, name)).value_or(rr::Bytes()); };
  if (type == "RSA") return rr::SignatureKey::from_rsa(number("n"), number("e"));
  if (type == "EC" && text_of(jwk, "crv") == "P-256") return rr::SignatureKey::from_p256(number("x"), number("y"));
  if (type == "OKP" && text_of(jwk, "crv") == "Ed25519") return rr::SignatureKey::from_ed25519(number("x"));
  if (type == "oct") return rr::SignatureKey::from_secret(number("k"));
  return rr::make_error(rr::ErrorCode::invalid_argument,
                        "kty is " + rr::quote(type) + ", expected RSA, EC (P-256), OKP (Ed25519) or oct");
}

bool is_for_signatures(const rr::Json& jwk, const rr::SignatureKey& key) {
  const auto use = text_of(jwk, "use");
  const auto algorithm = text_of(jwk, "alg");
  return (use.empty() || use == "sig") && (algorithm.empty() || parse_algorithm(algorithm) == key.algorithm());
}

std::array<std::string_view, 3> parts_of(std::string_view token) {
  const auto first = token.find('.');
  const auto second = token.find('.', first + 1);
  return {token.substr(0, first), token.substr(first + 1, second - first - 1), token.substr(second + 1)};
}

std::optional<rr::Json> read_object(std::string_view part) {
  const auto bytes = decode_base64url(part);
  if (!bytes) return std::nullopt;
  auto json = rr::read_json(rr::as_text(*bytes));
  if (!json || !json->is_object()) return std::nullopt;
  return std::move(*json);
}

/// A claim by its name, else by names with dots between. Null: not there.
const rr::Json* find_claim(const rr::Json& claims, const std::string& name) {
  if (const auto found = claims.find(name); found != claims.end()) return &*found;
  const auto dot = name.find('.');
  if (dot == std::string::npos) return nullptr;
  const auto outer = claims.find(name.substr(0, dot));
  return outer != claims.end() && outer->is_object() ? find_claim(*outer, name.substr(dot + 1)) : nullptr;
}

rr::Result<> check_time(const rr::Json& claims, std::chrono::system_clock::time_point now) {
  const double seconds = std::chrono::duration<double>(now.time_since_epoch()).count();
  const auto expires = claims.find("exp");
  if (expires == claims.end() || !expires->is_number()) return refused("it has no time at which it expires (exp)");
  if (!(seconds < expires->get<double>() + clock_slack)) return refused("it has expired");
  for (const auto* name : {"nbf", "iat"}) {
    const auto begins = claims.find(name);
    if (begins == claims.end()) continue;
    if (!begins->is_number() || !(begins->get<double>() <= seconds + clock_slack))
      return refused(std::string(name) + " is not a time in the past");
  }
  return {};
}

/// Of what check_time() has found good.
Identity::Time end_of(const rr::Json& claims) {
  const double seconds = claims.at("exp").get<double>() + clock_slack;
  constexpr double far = 1e9;  // seconds; the clock counts nanoseconds
  if (seconds > std::chrono::duration<double>(Identity::never.time_since_epoch()).count() - far) return Identity::never;
  return Identity::Time(std::chrono::duration_cast<Identity::Time::duration>(std::chrono::duration<double>(seconds)));
}

rr::Result<> check_parties(const rr::Json& claims, const JwtClaims& wanted) {
  if (!wanted.issuer.empty() && text_of(claims, "iss") != wanted.issuer) return refused("it is of another issuer");
  if (wanted.audience.empty()) return {};
  const auto audience = claims.find("aud");
  const bool is_for_us =
      audience != claims.end() &&
      (*audience == wanted.audience ||
       (audience->is_array() && std::find(audience->begin(), audience->end(), wanted.audience) != audience->end()));
  if (!is_for_us) return refused("it is for another audience");
  return {};
}

std::vector<std::string> read_roles(const rr::Json* claim) {
  std::vector<std::string> out;
  if (!claim) return out;
  if (claim->is_array()) {
    for (const auto& role : *claim)
      if (role.is_string() && out.size() < max_roles) out.push_back(role.get<std::string>());
  } else if (claim->is_string()) {
    const auto text = claim->get<std::string>();
    for (std::size_t at = 0; at < text.size() && out.size() < max_roles;) {
      const auto end = std::min(text.find(' ', at), text.size());
      if (end > at) out.push_back(text.substr(at, end - at));
      at = end + 1;
    }
  }
  return out;
}

}  // namespace

bool looks_like_jwt(std::string_view text) {
  return std::count(text.begin(), text.end(), '.') == 2;
}

rr::Result<JwtVerifier> JwtVerifier::from_jwks(std::string_view text, JwtClaims claims) {
  const auto json = rr::read_json(text);
  if (!json) return unusable_key_set(json.error().message);
  const auto keys = json->is_object() ? json->find("keys") : json->end();
  if (!json->is_object() || keys == json->end() || !keys->is_array() || keys->size() > max_keys)
    return unusable_key_set("expected {\"keys\": [...]} with at most " + std::to_string(max_keys) + " keys");
  JwtVerifier out(std::move(claims));
  std::string problem = "there is none in it";
  for (const auto& jwk : *keys) {
    if (!jwk.is_object()) continue;
    auto key = read_key(jwk);
    if (!key)
      problem = key.error().message;
    else if (is_for_signatures(jwk, *key))
      out.add(text_of(jwk, "kid"), std::move(*key), material_of(jwk));
  }
  if (out.keys_.empty()) return unusable_key_set("no key can be used: " + problem);
  return out;
}

rr::Result<JwtVerifier> JwtVerifier::from_published(std::string_view text, JwtClaims claims) {
  auto out = from_jwks(text, std::move(claims));
  if (!out) return out;
  std::erase_if(out->keys_, [](const Key& key) { return key.key.algorithm() == rr::SignatureAlgorithm::hs256; });
  out->proof_ = Proof::oidc;
  if (out->keys_.empty()) return unusable_key_set("no key can be used: a secret that is published is none");
  return out;
}

void JwtVerifier::add(std::string id, rr::SignatureKey key, rr::ByteSpan material) {
  rr::Bytes all(material.begin(), material.end());
  for (const auto* claim : {&claims_.issuer, &claims_.audience, &claims_.user_claim, &claims_.roles_claim}) {
    all.push_back(0);
    all.insert(all.end(), claim->begin(), claim->end());
  }
  keys_.push_back({std::move(id), std::move(key), encode_base64url(rr::sha256(all))});
}

bool JwtVerifier::knows(std::string_view credential) const {
  return std::any_of(keys_.begin(), keys_.end(), [&](const Key& key) { return key.credential == credential; });
}

bool JwtVerifier::misses_key_of(std::string_view token) const {
  if (!looks_like_jwt(token) || token.size() > max_token_size) return false;
  const auto header = read_object(parts_of(token)[0]);
  if (!header) return false;
  const auto id = text_of(*header, "kid");
  const auto fits = [&id](const Key& key) { return id.empty() || key.id.empty() || key.id == id; };
  return std::none_of(keys_.begin(), keys_.end(), fits);
}

rr::Result<JwtVerifier> JwtVerifier::from_secret(std::string_view text, JwtClaims claims) {
  while (!text.empty() && std::string_view(" \t\r\n").find(text.back()) != std::string_view::npos)
    text.remove_suffix(1);
  auto key = rr::SignatureKey::from_secret(rr::as_bytes(text));
  if (!key) return unusable_key_set(key.error().message);
  JwtVerifier out(std::move(claims));
  out.add({}, std::move(*key), rr::as_bytes(text));
  return out;
}

rr::Result<const JwtVerifier::Key*> JwtVerifier::check_signature(std::string_view signed_part,
                                                                 std::string_view header_part,
                                                                 rr::ByteSpan signature) const {
  const auto header = read_object(header_part);
  if (!header) return refused("its header can't be read");
  if (header->contains("crit")) return refused("its header asks for extensions that are unknown here");
  const auto name = text_of(*header, "alg");
  const auto algorithm = parse_algorithm(name);
  if (!algorithm) return refused("algorithm " + rr::quote(name) + "; expected RS256, ES256, EdDSA or HS256");
  const auto id = text_of(*header, "kid");
  bool has_key = false;
  for (const auto& key : keys_) {
    // A token without a key's name is tried with all; a key without a name is tried for all.
    if (key.key.algorithm() != *algorithm || (!id.empty() && !key.id.empty() && key.id != id)) continue;
    has_key = true;
    if (key.key.verifies(signed_part, signature)) return &key;
  }
  return refused(has_key ? "its signature is wrong" : "there is no key of its name and algorithm here");
}

rr::Result<Identity> JwtVerifier::verify(std::string_view token, std::chrono::system_clock::time_point now) const {
  if (!looks_like_jwt(token) || token.size() > max_token_size) return refused("it is no JSON Web Token");
  const auto [header, payload, signature_text] = parts_of(token);
  const auto signature = decode_base64url(signature_text);
  if (!signature) return refused("its signature can't be read");
  const auto signed_part = token.substr(0, header.size() + 1 + payload.size());
  const auto key = check_signature(signed_part, header, *signature);
  if (!key) return key.error();
  // From here on the issuer speaks.
  const auto claims = read_object(payload);
  if (!claims) return refused("its claims can't be read");
  if (auto checked = check_time(*claims, now); !checked) return checked.error();
  if (auto checked = check_parties(*claims, claims_); !checked) return checked.error();
  Identity out;
  const auto* user = find_claim(*claims, claims_.user_claim);
  if (user && user->is_string()) out.name = user->get<std::string>();
  if (out.name.empty()) return refused("it names no user (" + rr::quote(claims_.user_claim) + ")");
  out.roles = out.proven_roles = read_roles(find_claim(*claims, claims_.roles_claim));
  out.proof = proof_;
  out.credential = (*key)->credential;
  out.ends = end_of(*claims);
  return out;
}

}  // namespace rrgate
