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
    access_.record({"ended", &identity_, nullptr, "what was shown was revoked or has expired"});
    identity_ = Identity{.client = std::move(identity_.client)};
  }
  return is_good_;
}

const Identity& Standing::identity() {
  (void)is_good();
  return identity_;
}

rr::Result<> Standing::check(const AccessRequest& what, Recorded recorded) {
  if (!is_good())
    return rr::make_error(rr::ErrorCode::authentication_error, "what you have shown was revoked or has expired");
  if (recorded == Recorded::first_time) {
    if (!noted_.contains(std::pair(what.path, what.member))) {
      if (noted_.size() >= max_noted) noted_.clear();
      noted_.emplace(what.path, what.member);
      recorded = Recorded::each_time;
    }
  }
  if (recorded == Recorded::each_time) return access_.check(identity_, what);
  return access_.state().rules.check(identity_, what);
}

}  // namespace rrgate
