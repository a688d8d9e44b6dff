#include "server/access/sealed_identity.hpp"

#include <algorithm>

#include "node/tls/digest.hpp"
#include "server/access/base64url.hpp"
#include "server/json/json.hpp"

namespace rrgate {

namespace {

using Time = SealedIdentity::Time;

std::int64_t to_milliseconds(Time time) {
  return std::chrono::duration_cast<std::chrono::milliseconds>(time.time_since_epoch()).count();
}

Time time_at(const rr::Json& json, const char* key) {
  const auto count = json.at(key).get<std::int64_t>();
  return count >= to_milliseconds(Identity::never) ? Identity::never : Time(std::chrono::milliseconds(count));
}

rr::Bytes sign(rr::ByteSpan key, std::string_view purpose, std::string_view content) {
  return rr::hmac_sha256(key, rr::as_bytes(std::string(purpose) + "." + std::string(content)));
}

}  // namespace

std::string make_seal_id() {
  return encode_base64url(rr::random_bytes(12));
}

std::optional<std::string> seal(rr::ByteSpan key, std::string_view purpose, const SealedIdentity& content) {
  const auto& who = content.who;
  const rr::Json json{{"name", who.name},
                      {"roles", who.proven_roles},
                      {"proof", static_cast<int>(who.proof)},
                      {"credential", who.credential},
                      {"sign_in", who.sign_in},
                      {"until", to_milliseconds(who.ends)},
                      {"id", content.id},
                      {"began", to_milliseconds(content.began)},
                      {"ends", to_milliseconds(content.ends)}};
  auto out = encode_base64url(rr::as_bytes(json.dump(-1, ' ', false, rr::Json::error_handler_t::replace)));
  out += "." + encode_base64url(sign(key, purpose, out));
  if (out.size() > max_sealed_size) return std::nullopt;
  return out;
}

std::optional<SealedIdentity> unseal(rr::ByteSpan key, std::string_view purpose, std::string_view text, Time now) {
  const auto dot = std::min(text.find('.'), text.size());
  const auto content = text.substr(0, dot);
  const auto signature = decode_base64url(text.substr(std::min(dot + 1, text.size())));
  if (!signature || !rr::equal_secrets(*signature, sign(key, purpose, content))) return std::nullopt;
  // What stands in it from here on, a gateway wrote.
  const auto json = rr::read_json(rr::as_text(decode_base64url(content).value()));
  SealedIdentity out;
  out.id = json->at("id").get<std::string>();
  out.began = time_at(*json, "began");
  out.ends = time_at(*json, "ends");
  if (out.ends <= now) return std::nullopt;
  auto& who = out.who;
  who.name = json->at("name").get<std::string>();
  who.roles = who.proven_roles = json->at("roles").get<std::vector<std::string>>();
  who.proof = static_cast<Proof>(json->at("proof").get<int>());
  who.credential = json->at("credential").get<std::string>();
  who.sign_in = json->at("sign_in").get<std::string>();
  who.ends = time_at(*json, "until");
  return out;
}

}  // namespace rrgate
