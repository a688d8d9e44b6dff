// Calls of the client's callbacks by a service session. Layer: session. Source: sessions spec section 2.9.
#include <utility>

#include "core/member/arguments.hpp"
#include "core/member/error_entry.hpp"
#include "core/session/service/service_session.hpp"

namespace rr {

namespace {

constexpr std::chrono::seconds callback_timeout{15};

std::uint32_t request_id_of(CallbackId id) {
  return static_cast<std::uint32_t>(id);
}

}  // namespace

Result<CallbackId> ServiceSession::call_callback(std::string_view path, const MemberDefinition& member,
                                                 std::span<const Value> arguments, Now now) {
  if (!service_) return make_error(ErrorCode::connection_error, "no client is connected");
  if (!may_use_service())
    return make_error(ErrorCode::authentication_error, "callback '" + member.name + "': the client has not logged in");
  if (callbacks_.size() >= options_.max_open_callbacks)
    return make_error(ErrorCode::out_of_system_resource, "callback '" + member.name +
                                                             "': " + std::to_string(options_.max_open_callbacks) +
                                                             " callbacks of this client wait for an answer already");
  if (request_id_of(++last_callback_id_) == 0) ++last_callback_id_;  // 0 is for what has no answer
  const auto id = last_callback_id_;
  connection_.begin_message(outgoing_);
  outgoing_.begin_entry(EntryType::callback_call_req, path, member.name, request_id_of(id));
  if (auto written = write_arguments(outgoing_, arguments, member, service_->types()); !written) return written.error();
  if (auto sent = connection_.send(outgoing_, now, member.has_modifier("urgent") || service_->is_remote()); !sent) {
    if (connection_.state() == ConnectionState::closed) leave(sent.error(), now);
    return sent.error();
  }
  callbacks_.emplace(id, OpenCallback{&member, now.steady + callback_timeout});
  return id;
}

void ServiceSession::handle_callback_reply(const Message& message, const MessageEntry& entry) {
  // The half of the id that the wire does not carry: open calls are among the last 2^32.
  const auto behind = request_id_of(last_callback_id_) - entry.request_id;
  const auto found = callbacks_.extract(last_callback_id_ - behind);
  if (!found) return;  // late, repeated, or never asked for
  const auto& types = service_->types();
  events_.push(CallbackCompleted{found.key(), entry.error == ErrorCode::none
                                                  ? read_return(message, entry, *found.mapped().member, types)
                                                  : Result<Value>(read_error(message, entry, types))});
}

void ServiceSession::expire_callbacks(Now now) {
  while (!callbacks_.empty() && callbacks_.begin()->second.deadline <= now.steady) {
    const auto expired = callbacks_.extract(callbacks_.begin());
    events_.push(CallbackCompleted{expired.key(),
                                   make_error(ErrorCode::request_timeout, "callback '" + expired.mapped().member->name +
                                                                              "': the client did not answer in time")});
  }
}

void ServiceSession::end_callbacks(const Error& reason) {
  for (const auto& [id, call] : std::exchange(callbacks_, {}))
    events_.push(CallbackCompleted{
        id, make_error(ErrorCode::connection_error, "callback '" + call.member->name + "': " + reason.message)});
}

}  // namespace rr
