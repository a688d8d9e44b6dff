// Tokens of strangers are refused, whatever they hold; claims that are signed give a name, or are refused; key sets and
// files of tokens can be read or say why not. The first byte chooses.
#include <openssl/evp.h>

#include <cstdio>
#include <cstdlib>

#include "server/access/access_rules.hpp"
#include "server/access/access_text.hpp"
#include "server/access/api_tokens.hpp"
#include "server/access/base64url.hpp"
#include "server/access/jwt.hpp"
#include "test/fuzz/memory_bound.hpp"

namespace {

using namespace rrgate;

const std::string secret(32, 's');
const auto now = std::chrono::system_clock::time_point(std::chrono::seconds(1'900'000'000));

void require(bool holds, const char* rule) {
  if (holds) return;
  std::fprintf(stderr, "broken: %s\n", rule);
  std::abort();
}

std::string sign(const std::string& claims) {
  const auto text = encode_base64url(rr::as_bytes(R"({"alg":"HS256"})")) + "." + encode_base64url(rr::as_bytes(claims));
  rr::Bytes mac(64);
  std::size_t size = 0;
  EVP_Q_mac(nullptr, "HMAC", nullptr, "SHA256", nullptr, secret.data(), secret.size(), rr::as_bytes(text).data(),
            text.size(), mac.data(), mac.size(), &size);
  return text + "." + encode_base64url(rr::ByteSpan(mac).first(size));
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const rr::fuzz::MemoryBound bound(size);
  if (size == 0) return 0;
  static const auto verifier = *JwtVerifier::from_secret(secret, {});
  static const auto tokens = *ApiTokens::from_text("a " + std::string(64, 'a') + " _ _");
  const std::string text(rr::as_text(rr::ByteSpan(data + 1, size - 1)));
  switch (data[0]) {
    case 't':
      require(!verifier.verify(text, now), "nobody knows the secret");
      require(!tokens.verify(text, now), "nobody knows the token");
      break;
    case 'c': {
      const auto who = verifier.verify(sign(text), now);
      require(!who || (!who->name.empty() && who->proof == Proof::jwt), "claims name a user");
      break;
    }
    case 'k': {
      const auto keys = JwtVerifier::from_jwks(text, {});
      require(!keys || keys->key_count() > 0, "a key set has keys");
      break;
    }
    case 'r': {
      const auto end = std::min(text.find('\n'), text.size());
      const AccessRule rule{.roles = {"a"}, .paths = {text.substr(0, end)}, .may = {Verb::read}};
      Identity who;
      who.roles = {"a"};
      const auto path = text.substr(end);
      const auto allowed = AccessRules({rule}, true).check(who, {.path = path});
      require(allowed || allowed.error().message.size() < 1000, "a refusal is a sentence");
      break;
    }
    default:
      static_cast<void>(ApiTokens::from_text(text));
      require(with_line(text, "name", "name x y").find("name x y\n") != std::string::npos,
              "a line is there once added");
  }
  return 0;
}
