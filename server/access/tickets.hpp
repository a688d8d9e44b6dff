// Tickets: who somebody is, for one upgrade soon. Pages can't put a header into it, and what is in a URL ends up in
// logs. Layer: server/access.
#pragma once

#include <chrono>
#include <map>
#include <optional>
#include <string>

#include "node/tls/digest.hpp"
#include "server/access/base64url.hpp"
#include "server/access/identity.hpp"

namespace rrgate {

class Tickets {
 public:
  using Time = std::chrono::steady_clock::time_point;
  static constexpr std::chrono::seconds lifetime{30};

  /// nullopt: too many are waiting to be used.
  std::optional<std::string> issue(const Identity& who, Time now) {
    std::erase_if(waiting_, [now](const auto& item) { return item.second.ends <= now; });
    if (waiting_.size() >= max_waiting) return std::nullopt;
    auto ticket = encode_base64url(rr::random_bytes(24));
    waiting_.emplace(ticket, Entry{who, now + lifetime});
    return ticket;
  }
  /// Works once. nullopt: unknown, used or too late.
  std::optional<Identity> redeem(const std::string& ticket, Time now) {
    const auto found = waiting_.extract(ticket);
    if (!found || found.mapped().ends <= now) return std::nullopt;
    return found.mapped().who;
  }

 private:
  struct Entry {
    Identity who;
    Time ends;
  };
  static constexpr std::size_t max_waiting = 4096;

  std::map<std::string, Entry> waiting_;
};

}  // namespace rrgate
