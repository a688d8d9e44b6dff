#include "server/rr/shared_access.hpp"

#include "core/session/service/service_index.hpp"
#include "core/session/service_path.hpp"

namespace rrgate {

namespace {

Verb verb_of(rr::EntryType type, const rr::MemberDefinition* member) {
  switch (type) {
    case rr::EntryType::property_set_req:
    case rr::EntryType::memory_write:
    case rr::EntryType::wire_poke_out_value_req:
    case rr::EntryType::wire_packet:
    case rr::EntryType::pipe_packet:
      return Verb::write;
    case rr::EntryType::function_call_req:
    case rr::EntryType::generator_next_req:
      return Verb::call;
    case rr::EntryType::event_req:
    case rr::EntryType::callback_call_req:
      return Verb::subscribe;
    case rr::EntryType::pipe_connect_req:
    case rr::EntryType::pipe_disconnect_req:
    case rr::EntryType::wire_connect_req:
    case rr::EntryType::wire_disconnect_req:
      return member ? verb_to_connect(*member) : Verb::subscribe;
    default:
      return Verb::read;
  }
}

Recorded recorded_of(rr::EntryType type) {
  switch (type) {
    case rr::EntryType::wire_packet:
    case rr::EntryType::pipe_packet:
      return Recorded::first_time;
    case rr::EntryType::event_req:
    case rr::EntryType::callback_call_req:
    case rr::EntryType::generator_next_req:
    case rr::EntryType::wire_disconnect_req:
    case rr::EntryType::pipe_disconnect_req:
      return Recorded::never;
    default:
      return Recorded::each_time;
  }
}

/// The name of the record.
std::string_view event_of(rr::LockCommand command) {
  switch (command) {
    case rr::LockCommand::unlock:
    case rr::LockCommand::exit_monitor:
      return "unlock";
    case rr::LockCommand::acquire_lease:
    case rr::LockCommand::renew_lease:
    case rr::LockCommand::take_lease:
      return "lease";
    case rr::LockCommand::release_lease:
      return "lease_end";
    default:
      return "lock";
  }
}

/// What is not about a member, but about a service or an object of it as such.
bool is_about_service(rr::EntryType type) {
  switch (type) {
    case rr::EntryType::null:
    case rr::EntryType::get_service_desc:
    case rr::EntryType::object_type_name:
    case rr::EntryType::connect_client:
    case rr::EntryType::connect_client_combined:
    case rr::EntryType::get_service_attributes:
      return true;
    default:
      return false;
  }
}

}  // namespace

Standing& SessionRights::standing_of(const rr::AuthenticatedUser* user) {
  if (!user) {
    user_.reset();
    return *shown_;
  }
  const auto subject = subject_of(*user);
  if (!user_ || user_is_ != subject) {
    user_ = std::make_shared<Standing>(access_, access_.in_session(shown_->identity(), user));
    user_is_ = subject;
  }
  return *user_;
}

bool SessionRights::have_changed(const rr::AuthenticatedUser* user) {
  auto subject = user ? subject_of(*user) : Subject();
  if (reviewed_by_ == access_.state_ptr() && reviewed_as_ == subject) return false;
  reviewed_by_ = access_.state_ptr();
  reviewed_as_ = std::move(subject);
  return true;
}

rr::Result<> SessionRights::admit_to_service(Standing& asker, const rr::MemberAccess& wanted,
                                             std::string_view service) {
  const auto of_service = node_.device_of(service);
  // A service that is not there: who may use anything of the node may hear so.
  const auto& device = of_service.empty() ? device_ : of_service;
  const auto& rules = access_.state().rules;
  if (device.empty() && rules.sees_any(asker.identity())) return {};
  const bool is_told = wanted.type != rr::EntryType::null;
  AccessRequest request{.device = device, .service = service};
  if (wanted.type == rr::EntryType::object_type_name) request.path = wanted.path;
  auto allowed = asker.check(request, is_told ? Recorded::each_time : Recorded::never);
  if (allowed || wanted.user || asker.identity().is_proven() || !access_.authenticator()) return allowed;
  // The same for a service that is not there.
  return rr::make_error(rr::ErrorCode::authentication_error,
                        "who is not logged in may not use service " + rr::quote(service));
}

rr::Result<> SessionRights::admit(const rr::MemberAccess& wanted, bool is_vital) {
  if (access_.is_open() && !access_.audit().is_used()) return {};
  auto& asker = standing_of(wanted.user);
  if (wanted.type == rr::EntryType::get_node_info)
    return wanted.path.empty() ? asker.check({.verb = Verb::admin}, Recorded::never)
                               : asker.check({.device = wanted.path}, Recorded::never);
  const auto service = rr::first_segments(wanted.path, 1);
  if (service == rr::service_index_name) return {};  // it tells each client what that may know
  if (!wanted.member && is_about_service(wanted.type)) return admit_to_service(asker, wanted, service);
  if (wanted.type == rr::EntryType::client_session_op_req) return {};
  AccessRequest request;
  const auto device = node_.device_of(service);
  request.device = device;
  request.service = service;
  request.path = wanted.path;
  if (wanted.member) request.member = wanted.member->name;
  request.verb = verb_of(wanted.type, wanted.member);
  request.is_shape = wanted.type == rr::EntryType::memory_get_param;
  request.is_vital = is_vital;
  return asker.check(request, recorded_of(wanted.type));
}

rr::Result<> SessionRights::admit_lock(std::string_view path, const rr::AuthenticatedUser* user, Recorded recorded) {
  if (access_.is_open() && !access_.audit().is_used()) return {};
  AccessRequest request{.path = path, .verb = Verb::lock};
  request.service = rr::first_segments(path, 1);
  const auto device = node_.device_of(request.service);
  request.device = device;
  return standing_of(user).check(request, recorded);
}

bool SessionRights::may_command(std::string_view path, const rr::AuthenticatedUser* user) {
  if (access_.is_open()) return true;
  const auto service = rr::first_segments(path, 1);
  const auto device = node_.device_of(service);
  return standing_of(user).may_command({.device = device, .service = service, .path = path});
}

AuditEntryPtr SessionRights::begin(const rr::MemberAccess& admitted) {
  if (!admitted.member || recorded_of(admitted.type) != Recorded::each_time) return nullptr;
  AccessRequest what{
      .path = admitted.path, .member = admitted.member->name, .verb = verb_of(admitted.type, admitted.member)};
  return begin(what, admitted.user, {});
}

void SessionRights::record_too_much(const rr::MemberAccess& admitted, std::string_view why) {
  const auto service = rr::first_segments(admitted.path, 1);
  const auto device = node_.device_of(service);
  AccessRequest what{.device = device, .service = service, .path = admitted.path};
  if (admitted.member) what.member = admitted.member->name;
  what.verb = verb_of(admitted.type, admitted.member);
  access_.record_too_much(standing_of(admitted.user).identity(), &what, why);
}

AuditEntryPtr SessionRights::begin_lock(const rr::LockWanted& wanted, const rr::AuthenticatedUser* user) {
  return begin({.path = wanted.path, .verb = Verb::lock}, user, event_of(wanted.command));
}

AuditEntryPtr SessionRights::begin(AccessRequest what, const rr::AuthenticatedUser* user, std::string_view event) {
  what.service = rr::first_segments(what.path, 1);
  const auto device = node_.device_of(what.service);
  what.device = device;
  return standing_of(user).begin(what, event);
}

}  // namespace rrgate
