#include "server/access/tickets.hpp"

#include <algorithm>

#include "node/tls/digest.hpp"
#include "server/access/base64url.hpp"
#include "server/json/json.hpp"

namespace rrgate {

namespace {

constexpr std::size_t key_size = 32;

std::int64_t to_milliseconds(Tickets::Time time) {
  return std::chrono::duration_cast<std::chrono::milliseconds>(time.time_since_epoch()).count();
}

}  // namespace

Tickets::Tickets() : Tickets(rr::random_bytes(key_size)) {}

std::optional<std::string> Tickets::issue(const Identity& who, Time now) const {
  const rr::Json content{{"name", who.name},
                         {"roles", who.proven_roles},
                         {"proof", static_cast<int>(who.proof)},
                         {"credential", who.credential},
                         {"until", to_milliseconds(who.ends)},
                         {"ends", to_milliseconds(now + lifetime)},
                         {"nonce", encode_base64url(rr::random_bytes(12))}};
  auto out = encode_base64url(rr::as_bytes(content.dump(-1, ' ', false, rr::Json::error_handler_t::replace)));
  out += "." + encode_base64url(rr::hmac_sha256(key_, rr::as_bytes(out)));
  if (out.size() > max_size) return std::nullopt;
  return out;
}

std::optional<Identity> Tickets::redeem(std::string_view ticket, Time now) {
  const auto dot = std::min(ticket.find('.'), ticket.size());
  const auto content = ticket.substr(0, dot);
  auto signature = decode_base64url(ticket.substr(std::min(dot + 1, ticket.size())));
  if (!signature || !rr::equal_secrets(*signature, rr::hmac_sha256(key_, rr::as_bytes(content)))) return std::nullopt;
  // What stands in it from here on, a gateway wrote.
  const auto json = rr::read_json(rr::as_text(decode_base64url(content).value()));
  const Time ends{std::chrono::milliseconds(json->at("ends").get<std::int64_t>())};
  if (ends <= now) return std::nullopt;
  if (used_.size() >= max_used) std::erase_if(used_, [now](const auto& item) { return item.second <= now; });
  if (used_.size() >= max_used || !used_.emplace(std::move(*signature), ends).second) return std::nullopt;
  Identity out;
  out.name = json->at("name").get<std::string>();
  out.roles = out.proven_roles = json->at("roles").get<std::vector<std::string>>();
  out.proof = static_cast<Proof>(json->at("proof").get<int>());
  out.credential = json->value("credential", "");
  const auto until = json->value("until", to_milliseconds(Identity::never));
  if (until < to_milliseconds(Identity::never)) out.ends = Time(std::chrono::milliseconds(until));
  return out;
}

}  // namespace rrgate
