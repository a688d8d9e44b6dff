// What locks are to one session: who may use a member, requests for locks, waiting for a monitor. Layer: session.
// Source: sessions spec sections 2.6 and 2.7.
#include <algorithm>
#include <utility>

#include "core/member/error_entry.hpp"
#include "core/session/service/service_session.hpp"
#include "core/session/service_path.hpp"

namespace rr {

namespace {

constexpr std::size_t max_waiting_enters = 64;

bool is_packet(EntryType type) {
  return type == EntryType::wire_packet || type == EntryType::pipe_packet;
}

bool is_disconnect(EntryType type) {
  return type == EntryType::wire_disconnect_req || type == EntryType::pipe_disconnect_req;
}

/// Whether object locks leave the member alone.
bool is_exempt(EntryType type, const MemberDefinition& member) {
  if (member.has_modifier("nolock")) return true;
  const bool is_read =
      type == EntryType::property_get_req || type == EntryType::memory_read || type == EntryType::memory_get_param;
  return is_read && member.has_modifier("nolockread");
}

}  // namespace

/// Locks hold for requests on members; packets of what is connected already go on, and so does whatever ends that.
Result<> ServiceSession::check_locks(const MessageEntry& entry, const HostedService::Found& found,
                                     const MemberDefinition& member, Now now) {
  if (is_packet(entry.type) || is_disconnect(entry.type)) return {};
  auto& locks = service_->object_locks();
  if (!locks.empty() && !is_exempt(entry.type, member)) {
    const auto path = canonical_path(entry.service_path);
    if (auto allowed = locks.check(path, user(), session_id_); !allowed) return allowed;
  }
  auto& monitors = service_->monitor_locks();
  return monitors.empty() ? Result<>{} : monitors.check(*found.object, session_id_, now);
}

/// RequestObjectLock, RequestClientObjectLock, ReleaseObjectLock.
Result<> ServiceSession::answer_object_lock(const MessageEntry& entry, Now now) {
  if (!user_) return make_error(ErrorCode::authentication_error, "User is not authenticated");
  if (!user_->has_privilege("objectlock") && !user_->has_privilege("objectlockoverride"))
    return make_error(ErrorCode::object_locked_error, "User does not have object locking privileges");
  if (!service_->policy().allow_object_lock)
    return make_error(ErrorCode::permission_denied, "This service does not allow object locks");
  const auto service = service_;
  if (const auto found = find_object(entry.service_path); !found) return found.error();
  if (!user_) return {};  // the application, which was asked, has ended the session
  const auto path = canonical_path(entry.service_path);
  auto& locks = service->object_locks();
  auto done = entry.member_name == "ReleaseObjectLock"   ? locks.unlock(path, *user_)
              : entry.member_name == "RequestObjectLock" ? locks.lock(path, *user_, 0)
                                                         : locks.lock(path, *user_, session_id_);
  if (!done) return done;
  begin_reply(entry);
  outgoing_.add_text("return", "OK");
  send_outgoing(now);
  return {};
}

/// MonitorEnter, MonitorContinueEnter, MonitorExit. Where the lock is not free the answer follows later.
Result<> ServiceSession::answer_monitor(const Message& message, const MessageEntry& entry, Now now) {
  const auto command = entry.member_name;
  if (command != "MonitorEnter" && command != "MonitorContinueEnter" && command != "MonitorExit")
    return protocol_error("Invalid ClientSessionOp command");
  auto found = find_object(entry.service_path);
  if (!found) return found.error();
  if (!service_) return {};  // the application, which was asked, has ended the session
  auto& monitors = service_->monitor_locks();
  if (command == "MonitorExit") {
    const auto was_locked = monitors.exit(*found->object, session_id_, now);
    if (!was_locked) return was_locked.error();
    tell_others_of_monitors();
    begin_reply(entry);
    if (*was_locked) outgoing_.add_text("return", "OK");
    send_outgoing(now);
    return {};
  }
  if (!found->object->is_monitor_lockable())
    return make_error(ErrorCode::invalid_argument, "Object is not monitor lockable");
  const bool is_waiting = std::any_of(enters_.begin(), enters_.end(),
                                      [&](const OpenEnter& enter) { return enter.object == found->object; });
  if (is_waiting || enters_.size() >= max_waiting_enters)
    return make_error(ErrorCode::invalid_operation, "Already acquiring or acquired monitor lock");
  Result<MonitorLocks::State> state = MonitorLocks::State::waiting;
  if (command == "MonitorEnter") {
    const auto timeout = read_monitor_timeout(message, entry);
    if (!timeout) return timeout.error();
    state = monitors.enter(found->object, session_id_, *timeout, now);
  } else {
    state = monitors.look(*found->object, session_id_, now);
  }
  if (!state) return state.error();
  OpenEnter enter{entry.request_id, std::string(entry.service_path), std::string(command), std::move(found->object),
                  now.steady + longest_wait};
  if (*state == MonitorLocks::State::owned)
    answer_lock_request(enter, "OK", now);
  else
    enters_.push_back(std::move(enter));
  return {};
}

Result<std::chrono::milliseconds> ServiceSession::read_monitor_timeout(const Message& message,
                                                                       const MessageEntry& entry) {
  const auto* timeout = message.elements_of(entry).find("timeout");
  if (!timeout) return make_error(ErrorCode::message_element_not_found, "Element timeout not found.");
  if (timeout->type != DataType::int32_t || timeout->count == 0)
    return make_error(ErrorCode::data_type_mismatch,
                      "timeout is " + std::string(data_type_name(timeout->type)) + ", expected int32");
  return std::chrono::milliseconds(load<std::int32_t>(timeout->data.data()));
}

void ServiceSession::send_session_op_reply(std::string_view path, std::string_view member, std::uint32_t request_id,
                                           const Result<std::string_view>& answer, Now now) {
  connection_.begin_message(outgoing_);
  outgoing_.begin_entry(EntryType::client_session_op_ret, path, member, request_id);
  if (answer)
    outgoing_.add_text("return", *answer);
  else
    write_error(outgoing_, answer.error());
  send_outgoing(now, service_->is_remote());
}

void ServiceSession::handle_locks_changed(Now now) {
  for (std::size_t i = 0; i < enters_.size() && service_;) {
    const auto state = service_->monitor_locks().look(*enters_[i].object, session_id_, now);
    const bool is_over = !state || *state == MonitorLocks::State::owned;
    if (!is_over && now.steady < enters_[i].answer_by) {
      ++i;
      continue;
    }
    const OpenEnter enter = std::move(enters_[i]);
    enters_.erase(enters_.begin() + static_cast<std::ptrdiff_t>(i));
    if (!state)
      answer_lock_request(enter, state.error(), now);
    else
      answer_lock_request(enter, is_over ? std::string_view("OK") : std::string_view("Continue"), now);
  }
}

TimePoint ServiceSession::next_enter_deadline() const {
  auto next = TimePoint::max();
  for (const auto& enter : enters_)
    next = std::min({next, enter.answer_by, service_->monitor_locks().next_change(*enter.object, session_id_)});
  return next;
}

void ServiceSession::tell_others_of_monitors() {
  if (service_->monitor_locks().has_waiting()) events_.push(LocksChanged{service_.get()});
}

/// The session may use the service no more.
void ServiceSession::leave_monitors() {
  enters_.clear();
  if (!service_ || service_->monitor_locks().empty()) return;
  service_->monitor_locks().remove_session(session_id_);
  tell_others_of_monitors();
}

void ServiceSession::leave_locks() {
  if (!service_) return;
  leave_monitors();
  if (user_) service_->object_locks().handle_logout(user_->name, session_id_);
  user_.reset();
}

void ServiceSession::set_user(std::optional<AuthenticatedUser> user, Now now) {
  auto& locks = service_->object_locks();
  const bool is_same = user_ && user && user_->name == user->name;  // who keeps what is locked
  if (user_ && !is_same) locks.handle_logout(user_->name, session_id_);
  user_ = std::move(user);
  if (user_ && !is_same) locks.handle_login(user_->name);
  if (may_use_service()) return;
  // Logged out of a service that requires a user: what was connected until now ends, too.
  leave_monitors();
  const auto root = service_->name();
  const Error why{ErrorCode::authentication_error, "the user has logged out"};
  release_wires(root, why, now);
  release_pipes(root, why, now);
}

}  // namespace rr
