// An identity as a text that only gateways with one key can have written. Layer: server/access.
#pragma once

#include <chrono>
#include <optional>
#include <string>
#include <string_view>

#include "core/support/bytes.hpp"
#include "server/access/identity.hpp"

namespace rrgate {

struct SealedIdentity {
  using Time = std::chrono::system_clock::time_point;

  Identity who = {};    ///< by what was shown then; for Access::renew()
  std::string id = {};  ///< no other one has it
  Time began = {};      ///< when it was shown
  Time ends = {};       ///< nobody takes it from then on
};

/// Longer ones fit neither a URL nor a cookie.
constexpr std::size_t max_sealed_size = 2048;

std::string make_seal_id();
/// What is sealed for one purpose is good for no other. nullopt: it has more roles than fit.
std::optional<std::string> seal(rr::ByteSpan key, std::string_view purpose, const SealedIdentity& content);
/// nullopt: of another key or purpose, or too late.
std::optional<SealedIdentity> unseal(rr::ByteSpan key, std::string_view purpose, std::string_view text,
                                     SealedIdentity::Time now);

}  // namespace rrgate
