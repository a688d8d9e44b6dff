#include "server/access/sign_ins.hpp"

#include <algorithm>

#include "node/tls/digest.hpp"
#include "server/access/base64url.hpp"
#include "server/access/ended_sign_ins.hpp"
#include "server/access/sealed_identity.hpp"

namespace rrgate {

namespace {

constexpr std::string_view sign_in_purpose = "sign-in";

SignIns::Time end_of(const SealedIdentity& sign_in, SignIns::Time now) {
  return std::min({now + SignIns::lifetime, sign_in.began + SignIns::longest, sign_in.who.ends});
}

std::string digest_of(const Subject& subject) {
  return encode_base64url(rr::sha256(rr::as_bytes(subject.key()))).substr(0, 22);
}

}  // namespace

SignIns::SignIns(rr::Bytes key, std::string file, Time now) : key_(std::move(key)), file_(std::move(file)) {
  if (file_.empty()) return;
  for (auto& each : read_ended_sign_ins(file_, now))
    ended_.add(std::move(each.id), std::move(each.subject), each.ends, now);
}

std::optional<std::string> SignIns::begin(const Identity& who, Time now) const {
  SealedIdentity made{who, make_seal_id(), now, {}};
  made.who.sign_in = made.id;
  made.ends = end_of(made, now);
  return seal(key_, sign_in_purpose, made);
}

std::optional<SealedIdentity> SignIns::open(std::string_view cookie, Time now) const {
  auto found = unseal(key_, sign_in_purpose, cookie, now);
  if (found && has_ended(found->id)) return std::nullopt;
  return found;
}

std::optional<Identity> SignIns::find(std::string_view cookie, Time now) const {
  auto found = open(cookie, now);
  return found ? std::optional(std::move(found->who)) : std::nullopt;
}

std::optional<std::string> SignIns::extend(std::string_view cookie, Time now) const {
  auto found = open(cookie, now);
  if (!found || found->ends - now > lifetime / 2) return std::nullopt;
  const auto ends = end_of(*found, now);
  if (ends <= found->ends) return std::nullopt;
  found->ends = ends;
  return seal(key_, sign_in_purpose, *found);
}

bool SignIns::end(const Identity& who, Time now) {
  return has_ended(who.sign_in) || ended_.add(who.sign_in, digest_of(who.subject()), now + lifetime, now);
}

rr::Result<> SignIns::keep_ended(const Identity& who, Time now) const {
  if (file_.empty()) return {};
  return add_ended_sign_in(file_, {who.sign_in, digest_of(who.subject()), now + lifetime}, now);
}

}  // namespace rrgate
