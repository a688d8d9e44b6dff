// Tickets: who somebody is, for one upgrade soon. Pages can't put a header into it, and what is in a URL ends up in
// logs. Layer: server/access.
#pragma once

#include <chrono>
#include <optional>
#include <string>
#include <string_view>

#include "core/support/bytes.hpp"
#include "server/access/identity.hpp"
#include "server/access/spent_seals.hpp"

namespace rrgate {

/// A ticket says all that it stands for, signed: no gateway keeps one, and gateways with one key take each other's.
class Tickets {
 public:
  using Time = std::chrono::system_clock::time_point;
  static constexpr std::chrono::seconds lifetime{30};

  explicit Tickets(rr::Bytes key) : key_(std::move(key)) {}

  /// nullopt: its roles don't fit into a URL.
  std::optional<std::string> issue(const Identity& who, Time now) const;
  /// Who it is for, by what had been shown then; for Access::renew(). Works once. nullopt: of another key, used, too
  /// late, or too many were used just now, of the same user or of all.
  std::optional<Identity> redeem(std::string_view ticket, Time now);

 private:
  rr::Bytes key_;
  SpentSeals used_;
};

}  // namespace rrgate
