#include "server/access/jwt.hpp"

#include <catch2/catch.hpp>

#include "test/server/access/jwt_signer.hpp"
#include "test/support/print.hpp"

using namespace rrgate;
using rrgate::test::JwtSigner;
using Json = nlohmann::json;

namespace {

const auto now = std::chrono::system_clock::time_point(std::chrono::seconds(1'900'000'000));
constexpr std::int64_t now_seconds = 1'900'000'000;
const std::string secret(32, 's');

Json claims(const Json& more = Json::object()) {
  Json out{{"sub", "alice"}, {"exp", now_seconds + 600}, {"roles", {"operator", "viewer"}}};
  out.update(more);
  return out;
}

std::string jwks(const std::vector<Json>& keys) {
  return Json{{"keys", keys}}.dump();
}

JwtVerifier verifier(const JwtSigner& signer, JwtClaims wanted = {}) {
  auto made = JwtVerifier::from_jwks(jwks({signer.jwk()}), std::move(wanted));
  REQUIRE(made);
  return std::move(*made);
}

std::string refusal(const JwtVerifier& verifier, const std::string& token) {
  const auto found = verifier.verify(token, now);
  if (found) return "taken";
  CHECK(found.error().code == rr::ErrorCode::authentication_error);
  return found.error().message;
}

}  // namespace

TEST_CASE("JWT: every algorithm, and no signature for another text") {
  for (const auto* algorithm : {"RS256", "ES256", "EdDSA", "HS256"}) {
    INFO(algorithm);
    const JwtSigner signer(algorithm, secret);
    const auto verify = verifier(signer);
    const auto token = signer.sign(claims());
    const auto found = verify.verify(token, now);
    REQUIRE(found);
    CHECK(found->name == "alice");
    CHECK(found->roles == std::vector<std::string>{"operator", "viewer"});
    CHECK(found->proof == Proof::jwt);
    for (const auto at : {token.find('.') - 3, token.find('.') + 5, token.size() - 10}) {
      auto changed = token;
      changed[at] = changed[at] == 'A' ? 'B' : 'A';
      CHECK(refusal(verify, changed) != "taken");
    }
    CHECK(refusal(verify, token.substr(0, token.rfind('.') + 1)) != "taken");
    CHECK(refusal(verify, token + "AAAA") != "taken");
    CHECK_THAT(refusal(verify, JwtSigner(algorithm, std::string(32, 'x')).sign(claims())),
               Catch::Contains("signature is wrong"));
  }
}

TEST_CASE("JWT: a key is known again by what it is, not by what it is called") {
  const JwtSigner first("ES256"), second("ES256");
  auto named = first.jwk();
  named["kid"] = "one";
  auto renamed = first.jwk();
  renamed["kid"] = "two";
  auto other = second.jwk();
  other["kid"] = "one";
  const auto made = JwtVerifier::from_jwks(jwks({named, second.jwk()}), {});
  REQUIRE(made);
  const auto credential = made->verify(first.sign(claims()), now).value().credential;
  CHECK_FALSE(credential.empty());
  CHECK(made->verify(second.sign(claims()), now).value().credential != credential);
  CHECK(made->knows(credential));
  CHECK(JwtVerifier::from_jwks(jwks({other, renamed}), {})->knows(credential));
  CHECK_FALSE(JwtVerifier::from_jwks(jwks({other}), {})->knows(credential));
  CHECK_FALSE(JwtVerifier::without_keys({}).knows(credential));
  CHECK_FALSE(made->knows(""));
}

TEST_CASE("JWT: the key says the algorithm") {
  const JwtSigner rsa("RS256");
  const auto verify = verifier(rsa);
  // No signature at all.
  for (const auto* none : {"none", "None", "", "HS384", "RS512"})
    CHECK_THAT(refusal(verify, rsa.sign(claims(), {{"alg", none}})), Catch::Contains("algorithm"));
  // The public key, known to all, taken for a secret.
  const auto modulus = rsa.jwk()["n"].get<std::string>();
  const auto bytes = decode_base64url(modulus);
  CHECK_THAT(refusal(verify, JwtSigner("HS256", modulus).sign(claims())), Catch::Contains("no key"));
  CHECK_THAT(refusal(verify, JwtSigner("HS256", std::string(bytes->begin(), bytes->end())).sign(claims())),
             Catch::Contains("no key"));
  // A key of the token's own, and extensions.
  const JwtSigner stranger("ES256");
  CHECK(refusal(verify, stranger.sign(claims(), {{"jwk", stranger.jwk()}})) != "taken");
  CHECK_THAT(refusal(verify, rsa.sign(claims(), {{"crit", {"b64"}}, {"b64", false}})), Catch::Contains("extensions"));
}

TEST_CASE("JWT: times, issuer and audience") {
  const JwtSigner signer("EdDSA");
  const auto verify = verifier(signer, {.issuer = "https://id.example", .audience = "rrgate"});
  const Json good{{"iss", "https://id.example"}, {"aud", "rrgate"}};
  const auto with = [&](const Json& more) {
    auto all = claims(good);
    all.update(more);
    return refusal(verify, signer.sign(all));
  };
  CHECK(with(Json::object()) == "taken");
  CHECK(with({{"aud", {"other", "rrgate"}}}) == "taken");
  CHECK(with({{"nbf", now_seconds + 20}}) == "taken");  // clocks differ
  CHECK(with({{"exp", now_seconds - 20}}) == "taken");
  CHECK_THAT(with({{"exp", now_seconds - 31}}), Catch::Contains("expired"));
  CHECK_THAT(with({{"exp", "never"}}), Catch::Contains("exp"));
  CHECK_THAT(with({{"nbf", now_seconds + 40}}), Catch::Contains("nbf"));
  CHECK_THAT(with({{"iat", now_seconds + 40}}), Catch::Contains("iat"));
  CHECK_THAT(with({{"iss", "https://id.example.org"}}), Catch::Contains("issuer"));
  CHECK_THAT(with({{"aud", "rrgate2"}}), Catch::Contains("audience"));
  CHECK_THAT(with({{"aud", {"other"}}}), Catch::Contains("audience"));
  auto endless = claims(good);
  endless.erase("exp");
  CHECK_THAT(refusal(verify, signer.sign(endless)), Catch::Contains("exp"));
}

TEST_CASE("JWT: where user and roles are") {
  const JwtSigner signer("ES256");
  const auto nested = verifier(signer, {.user_claim = "preferred_username", .roles_claim = "realm_access.roles"});
  const auto found = nested.verify(
      signer.sign(claims({{"preferred_username", "bob"}, {"realm_access", {{"roles", {"a", 7, "b"}}}}})), now);
  REQUIRE(found);
  CHECK(found->name == "bob");
  CHECK(found->roles == std::vector<std::string>{"a", "b"});
  CHECK_THAT(refusal(nested, signer.sign(claims())), Catch::Contains("names no user"));
  const auto scopes = verifier(signer, {.roles_claim = "scope"});
  CHECK(scopes.verify(signer.sign(claims({{"scope", " read  write "}})), now)->roles ==
        std::vector<std::string>{"read", "write"});
  CHECK(scopes.verify(signer.sign(claims()), now)->roles.empty());
  CHECK(refusal(scopes, signer.sign(claims({{"sub", 7}}))) != "taken");
}

TEST_CASE("JWT: keys by name, and what is wrong with a key set") {
  const JwtSigner first("RS256");
  const JwtSigner second("RS256");
  const auto verify = JwtVerifier::from_jwks(jwks({first.jwk("1"), second.jwk("2")}), {});
  REQUIRE(verify);
  CHECK(refusal(*verify, first.sign(claims(), {{"kid", "1"}})) == "taken");
  CHECK(refusal(*verify, second.sign(claims(), {{"kid", "2"}})) == "taken");
  CHECK(refusal(*verify, second.sign(claims())) == "taken");
  CHECK_THAT(refusal(*verify, first.sign(claims(), {{"kid", "2"}})), Catch::Contains("signature"));
  CHECK_THAT(refusal(*verify, first.sign(claims(), {{"kid", "3"}})), Catch::Contains("no key"));

  const auto problem = [](const std::string& text) {
    const auto made = JwtVerifier::from_jwks(text, {});
    return made ? "good" : made.error().message;
  };
  auto for_encryption = first.jwk();
  for_encryption["use"] = "enc";
  auto of_another = first.jwk();
  of_another["alg"] = "PS256";
  CHECK_THAT(problem(jwks({for_encryption, of_another})), Catch::Contains("no key"));
  CHECK_THAT(problem(jwks({JwtSigner("RS256", {}, 1024).jwk()})), Catch::Contains("1024 bits"));
  CHECK_THAT(problem(jwks({{{"kty", "EC"}, {"crv", "P-384"}}})), Catch::Contains("expected RSA"));
  auto off_curve = JwtSigner("ES256").jwk();
  off_curve["x"] = encode_base64url(rr::Bytes(32, 1));
  CHECK_THAT(problem(jwks({off_curve})), Catch::Contains("no point"));
  std::vector<Json> many;
  for (int i = 0; i < 64; ++i) many.push_back(first.jwk(std::to_string(i)));
  CHECK(problem(jwks(many)) == "good");
  many.push_back(first.jwk("64"));
  CHECK_THAT(problem(jwks(many)), Catch::Contains("at most 64 keys"));
  CHECK_THAT(problem("[]"), Catch::Contains("keys"));
  CHECK_THAT(problem("{"), Catch::Contains("JSON") || !Catch::Contains("good"));
  CHECK_FALSE(JwtVerifier::from_secret("short\n", {}));
  const auto by_secret = JwtVerifier::from_secret(secret + "\n", {});
  REQUIRE(by_secret);
  CHECK(refusal(*by_secret, JwtSigner("HS256", secret).sign(claims())) == "taken");
}

TEST_CASE("JWT: a key set that is published has no secrets, and may lack the key that a token names") {
  const JwtSigner signer("ES256");
  const nlohmann::json secret_key = {{"kty", "oct"}, {"k", encode_base64url(rr::as_bytes(secret))}, {"kid", "s"}};
  const auto verify = JwtVerifier::from_published(jwks({signer.jwk("1"), secret_key}), {});
  REQUIRE(verify);
  CHECK(refusal(*verify, signer.sign(claims(), {{"kid", "1"}})) == "taken");
  CHECK(verify->verify(signer.sign(claims()), now).value().proof == Proof::oidc);
  CHECK(refusal(*verify, JwtSigner("HS256", secret).sign(claims(), {{"kid", "s"}})) != "taken");
  CHECK_FALSE(JwtVerifier::from_published(jwks({secret_key}), {}));
  CHECK(verify->misses_key_of(signer.sign(claims(), {{"kid", "2"}})));
  CHECK_FALSE(verify->misses_key_of(signer.sign(claims(), {{"kid", "1"}})));
  CHECK_FALSE(verify->misses_key_of(signer.sign(claims())));
  CHECK_FALSE(verify->misses_key_of("no.token"));
  const auto none = JwtVerifier::without_keys({});
  CHECK(none.misses_key_of(signer.sign(claims())));
  CHECK(refusal(none, signer.sign(claims())) != "taken");
}

TEST_CASE("JWT: what is none") {
  const JwtSigner signer("EdDSA");
  const auto verify = verifier(signer);
  for (const auto* text : {"", ".", "..", "...", "a.b.c", "e30.e30.", "e30.e30.e30"})
    CHECK(refusal(verify, text) != "taken");
  CHECK(refusal(verify, std::string(20'000, 'a') + ".b.c") != "taken");
  const auto text = [](std::string_view part) { return encode_base64url(rr::as_bytes(part)); };
  const auto header = text(R"({"alg":"EdDSA"})");
  for (const auto* payload : {"7", "[]", "null", "{", R"({"sub":"a","sub":"b","exp":99999999999})"})
    CHECK_THAT(refusal(verify, signer.sign_text(header + "." + text(payload))), Catch::Contains("claims"));
}
