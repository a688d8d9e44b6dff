#include "server/access/standing.hpp"

namespace rrgate {

bool Standing::is_good() {
  if (!is_good_) return false;
  const bool has_end = identity_.ends != Identity::never;
  const bool has_expired = has_end && std::chrono::system_clock::now() >= identity_.ends;
  if (judged_by_ == access_.state_ptr() && !has_expired) return true;
  judged_by_ = access_.state_ptr();
  noted_.clear();
  auto renewed = access_.renew(identity_);
  is_good_ = renewed.has_value();
  if (is_good_) {
    identity_ = std::move(*renewed);
  } else {
    access_.record({.event = "ended", .who = &identity_, .detail = "what was shown was revoked or has expired"});
    identity_ = access_.anonymous(std::move(identity_.client), identity_.face);
    identity_.roles.clear();
  }
  return is_good_;
}

const Identity& Standing::identity() {
  (void)is_good();
  return identity_;
}

rr::Result<bool> Standing::judge(const AccessRequest& what, Recorded recorded) {
  if (!is_good())
    return rr::make_error(rr::ErrorCode::authentication_error, "what you have shown was revoked or has expired");
  const bool is_noted = recorded == Recorded::first_time && noted_.contains(std::pair(what.path, what.member));
  const bool is_told = recorded != Recorded::never && !is_noted;
  const auto checked = is_told ? access_.check(identity_, what) : access_.state().rules.check(identity_, what);
  const bool can_be_told = checked || checked.error().code != rr::ErrorCode::out_of_system_resource;
  if (recorded == Recorded::first_time && is_told && can_be_told) {
    if (noted_.size() >= max_noted) noted_.clear();
    noted_.emplace(what.path, what.member);
  }
  if (!checked) return checked.error();
  return is_told;
}

rr::Result<> Standing::check(const AccessRequest& what, Recorded recorded) {
  const auto judged = judge(what, recorded);
  if (!judged) return judged.error();
  if (recorded == Recorded::first_time && *judged)
    if (const auto entry = access_.begin(identity_, what)) entry->finish({});
  return {};
}

rr::Result<AuditEntryPtr> Standing::check_and_begin(const AccessRequest& what, std::string_view trace,
                                                    Recorded recorded, std::string_view event) {
  const auto judged = judge(what, recorded);
  if (!judged) return judged.error();
  return *judged ? access_.begin(identity_, what, trace, event) : nullptr;
}

}  // namespace rrgate
