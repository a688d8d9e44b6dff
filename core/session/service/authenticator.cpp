#include "core/session/service/authenticator.hpp"

#include <algorithm>

namespace rr {

bool AuthenticatedUser::has_privilege(std::string_view privilege) const {
  return std::find(privileges.begin(), privileges.end(), privilege) != privileges.end();
}

void LoginLimit::forget_failures(Now now) {
  const auto passed = std::chrono::duration_cast<std::chrono::seconds>(now.steady - forgotten_until_).count();
  if (passed <= 0) return;
  failures_ -= std::min<std::size_t>(failures_, static_cast<std::size_t>(passed));
  forgotten_until_ = now.steady;
}

Result<LoginLimit::Ticket> LoginLimit::begin(Now now) {
  forget_failures(now);
  if (failures_ >= max_failures_)
    return make_error(ErrorCode::authentication_error, "too many logins have failed; try again later");
  if (static_cast<std::size_t>(tickets_.use_count()) > max_judged_at_once_)
    return make_error(ErrorCode::out_of_system_resource, "too many logins at once; try again later");
  return tickets_;
}

void LoginLimit::handle_failure(Now now) {
  forget_failures(now);
  if (failures_ == 0) forgotten_until_ = now.steady;
  ++failures_;
}

}  // namespace rr
