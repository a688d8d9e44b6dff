// What a client may do for as long as it is there. Layer: server/access.
#pragma once

#include <memory>
#include <set>
#include <string>
#include <string_view>
#include <utility>

#include "server/access/access.hpp"

namespace rrgate {

/// What the audit log has of a thing that is done.
enum class Recorded : std::uint8_t {
  each_time,
  first_time,  ///< packets of a wire or a pipe: there may be thousands a second
  never,       ///< part of something whose beginning is recorded, or done by the device; its refusals neither
};

/// A client and what it has shown, looked at anew whenever users, tokens or rights have changed. Who keeps a connection
/// open keeps one of these. For the gateway's thread; the Access outlives it.
class Standing {
 public:
  /// `identity`  may have been found some time ago: it is judged anew when it is first looked at.
  Standing(Access& access, Identity identity) : access_(access), identity_(std::move(identity)) {}

  /// Whether what the client has shown is still good: it was not revoked, and has not expired. Once false, for ever.
  bool is_good();
  /// As of now; who is not good any more is nobody.
  const Identity& identity();
  /// See Access::check(). What is recorded the first time alone, is. Errors   also authentication_error: not good any
  /// more.
  [[nodiscard]] rr::Result<> check(const AccessRequest& what, Recorded recorded = Recorded::each_time);
  /// See Access::check_and_begin(). Null also where it is recorded the first time alone, and this is not that.
  [[nodiscard]] rr::Result<AuditEntryPtr> check_and_begin(const AccessRequest& what, std::string_view trace,
                                                          Recorded recorded, std::string_view event = {});
  /// See AccessRules::may_command(). False also: not good any more.
  bool may_command(const AccessRequest& object) {
    return is_good() && access_.state().rules.may_command(identity_, object);
  }
  /// See Access::begin().
  AuditEntryPtr begin(const AccessRequest& what, std::string_view event = {}) {
    return access_.begin(identity(), what, {}, event);
  }

 private:
  using Place = std::pair<std::string, std::string>;  ///< path and member
  /// Also compares views, so that each packet is looked up without a copy.
  struct ByPlace {
    using is_transparent = void;
    template <class A, class B>
    bool operator()(const A& a, const B& b) const {
      using Views = std::pair<std::string_view, std::string_view>;
      return Views(a.first, a.second) < Views(b.first, b.second);
    }
  };

  static constexpr std::size_t max_noted = 4096;

  /// Whether it may be done, and if so, whether that is to be recorded.
  rr::Result<bool> judge(const AccessRequest& what, Recorded recorded);

  Access& access_;
  AccessStatePtr judged_by_;  ///< null: not yet
  Identity identity_;
  bool is_good_ = true;
  std::set<Place, ByPlace> noted_;  ///< what was recorded for the first time
};
using StandingPtr = std::shared_ptr<Standing>;

}  // namespace rrgate
