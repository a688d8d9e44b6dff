#include "server/access/tickets.hpp"

#include "node/tls/digest.hpp"
#include "server/access/sealed_identity.hpp"

namespace rrgate {

namespace {

constexpr std::string_view ticket_purpose = "ticket";

}  // namespace

std::optional<std::string> Tickets::issue(const Identity& who, Time now) const {
  return seal(key_, ticket_purpose, {who, make_seal_id(), now, now + lifetime});
}

std::optional<Identity> Tickets::redeem(std::string_view ticket, Time now) {
  auto found = unseal(key_, ticket_purpose, ticket, now);
  if (!found) return std::nullopt;
  if (!used_.add(std::move(found->id), found->who.subject().key(), found->ends, now)) return std::nullopt;
  return std::move(found->who);
}

}  // namespace rrgate
