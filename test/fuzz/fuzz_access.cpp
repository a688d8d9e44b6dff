// Tokens, tickets and sign-ins of strangers are refused, whatever they hold; claims that are signed give a name, or are
// refused; key sets, documents of issuers and files of tokens and users can be read or say why not. The first byte
// chooses.
#include <openssl/evp.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>

#include "core/support/utf8.hpp"
#include "node/service/password_file.hpp"
#include "server/access/access_rules.hpp"
#include "server/access/access_text.hpp"
#include "server/access/api_tokens.hpp"
#include "server/access/base64url.hpp"
#include "server/access/issuer_document.hpp"
#include "server/access/jwt.hpp"
#include "server/access/sign_ins.hpp"
#include "server/access/tickets.hpp"
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

/// Sealed content of a stranger, and what a gateway seals, whatever it is of.
void check_seals(const std::string& text) {
  const rr::Bytes key(32, 1);
  Tickets tickets(key);
  SignIns sign_ins(key);
  require(!tickets.redeem(text, now) && !sign_ins.find(text, now) && !sign_ins.extend(text, now),
          "nobody knows the key");
  const Identity who{.name = text, .proven_roles = {text.substr(text.size() / 2)}, .proof = Proof::password};
  const auto ticket = tickets.issue(who, now);
  const auto cookie = sign_ins.begin(who, now);
  if (!ticket || !cookie) return;
  require(!tickets.redeem(*cookie, now) && !sign_ins.find(*ticket, now), "a ticket is no sign-in");
  const auto redeemed = tickets.redeem(*ticket, now);
  const auto found = sign_ins.find(*cookie, now);
  require(redeemed && found && redeemed->name == found->name && redeemed->proof == Proof::password,
          "who is sealed is read");
  require(!rr::is_utf8(text) || redeemed->name == text, "a name stays the same");
  require(!tickets.redeem(*ticket, now), "a ticket is good once");
  require(!sign_ins.find(*cookie, now + SignIns::lifetime), "a sign-in ends");
}

/// What is asked of an issuer, as its document says.
void check_issuer(std::string_view text) {
  const auto keys_url = read_issuer_document(text, "https://id.example");
  if (!keys_url) {
    require(keys_url.error().message.size() < 2000, "an error is a sentence");
    return;
  }
  const auto get = make_https_get(*keys_url);
  if (!get) return;
  require(get->request.find("\r\n\r\n") == get->request.size() - 4, "a request has one head");
  require(std::count(get->request.begin(), get->request.end(), '\n') == 6, "no header is added to a request");
  require(!get->host.empty() && get->port > 0, "there is somebody to ask");
}

void check_users(std::string_view text) {
  const auto users = rr::PasswordFileAuthenticator::from_text(text, {.accepts_md5 = true});
  if (!users) {
    require(users.error().message.size() < 1000, "an error is a sentence");
    return;
  }
  const auto names = (*users)->names();
  require(names.size() == (*users)->user_count(), "users have a name each");
  for (const auto& name : names) {
    const auto entry = (*users)->find(name);
    require(entry && !entry->hash.empty(), "a user has a password");
    // As `rrgate passwd` writes it.
    const auto line = name + " " + entry->hash + " _";
    const auto again = rr::PasswordFileAuthenticator::from_text(line, {.accepts_md5 = true});
    require(again && (*again)->find(name)->hash == entry->hash, "what was read can be written");
  }
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
    case 's':
      check_seals(text);
      break;
    case 'i':
      check_issuer(text);
      break;
    case 'u':
      check_users(text);
      break;
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
