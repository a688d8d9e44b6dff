// Sign-ins of pages: what somebody has shown once, as a cookie. Layer: server/access.
#pragma once

#include <chrono>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

#include "core/support/bytes.hpp"
#include "core/support/error.hpp"
#include "server/access/identity.hpp"
#include "server/access/spent_seals.hpp"

namespace rrgate {

struct SealedIdentity;

/// A sign-in says all that it stands for, signed, as a ticket does: gateways with one key take each other's. Only which
/// ones have been ended is kept, by the gateway that was told so, in a file too where it has one.
class SignIns {
 public:
  using Time = std::chrono::system_clock::time_point;
  static constexpr std::chrono::hours lifetime{8};      ///< without use
  static constexpr std::chrono::hours longest{7 * 24};  ///< with

  explicit SignIns(rr::Bytes key) : key_(std::move(key)) {}
  /// `file`  of those that have ended, which is read now; "": none. See read_ended_sign_ins().
  SignIns(rr::Bytes key, std::string file, Time now);

  /// nullopt: its roles don't fit into a cookie.
  std::optional<std::string> begin(const Identity& who, Time now) const;
  /// Who it is of, by what had been shown then; for Access::renew(). nullopt: of another key, too late, or ended.
  std::optional<Identity> find(std::string_view cookie, Time now) const;
  /// Another cookie of the same sign-in, where half the time of this one is over. nullopt: not yet, or never.
  std::optional<std::string> extend(std::string_view cookie, Time now) const;
  /// No cookie of this sign-in is taken any more. False: too many of the same user have ended lately, or of all.
  bool end(const Identity& who, Time now);
  /// Puts one that has just ended into the file. Errors   io_error: it can't be written.
  [[nodiscard]] rr::Result<> keep_ended(const Identity& who, Time now) const;
  bool has_ended(const std::string& id) const { return ended_.has(id); }

 private:
  std::optional<SealedIdentity> open(std::string_view cookie, Time now) const;

  rr::Bytes key_;
  std::string file_;
  SpentSeals ended_;  ///< until their last cookie would be too late
};

}  // namespace rrgate
