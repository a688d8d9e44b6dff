// ClientSessionOpReq: logins, object locks and monitor locks, as a client asks for them. Layer: session.
// Source: sessions spec section 2.6.
#include <algorithm>
#include <limits>
#include <utility>

#include "core/session/client/client_session.hpp"

namespace rr {

namespace {

constexpr std::string_view monitor_continue_enter = "MonitorContinueEnter";

}  // namespace

/// One operation of the session: `add_elements` writes what the command needs.
template <class AddElements>
RequestId ClientSession::request_session_op(std::string_view path, std::string_view command, Now now,
                                            AddElements&& add_elements) {
  if (state_ != ClientState::connected) return fail_request(next_request_id(), not_connected());
  const auto id = begin_request(EntryType::client_session_op_req, path, command);
  if (Result<> added = add_elements(); !added) return fail_request(id, added.error());
  if (auto sent = send_outgoing(now); !sent) return fail_request(id, sent.error());
  add_pending(id, EntryType::client_session_op_req, nullptr, path, now);
  return id;
}

namespace {

/// What most commands need: up to two numbers. One type for all, so that the request is compiled once.
struct Numbers {
  Message* to = nullptr;
  std::string_view name = {};
  std::int32_t number = 0;
  std::string_view other_name = {};
  std::int32_t other = 0;

  Result<> operator()() const {
    if (!name.empty()) to->add_scalar(name, DataType::int32_t, number);
    if (!other_name.empty()) to->add_scalar(other_name, DataType::int32_t, other);
    return {};
  }
};

}  // namespace

RequestId ClientSession::authenticate(std::string_view username, const Value& credentials, Now now) {
  return request_session_op(options_.service, "AuthenticateUser", now, [&]() -> Result<> {
    outgoing_.add_text("username", username);
    if (!credentials.get_if<MapString>())
      return make_error(ErrorCode::invalid_argument,
                        "credentials are " + credentials.type_text() + ", expected map{string}");
    return pack_varvalue(outgoing_, "credentials", credentials, types_);
  });
}

RequestId ClientSession::logout(Now now) {
  return request_session_op(options_.service, "LogoutUser", now, [&]() -> Result<> {
    outgoing_.add_text("username", options_.username);  // services do not look at it
    return {};
  });
}

RequestId ClientSession::lock(std::string_view path, LockKind kind, Now now) {
  const auto command = kind == LockKind::user ? "RequestObjectLock" : "RequestClientObjectLock";
  return request_session_op(path, command, now, Numbers{});
}

RequestId ClientSession::unlock(std::string_view path, Now now) {
  return request_session_op(path, "ReleaseObjectLock", now, Numbers{});
}

RequestId ClientSession::enter_monitor(std::string_view path, std::chrono::milliseconds timeout, Now now) {
  constexpr std::int64_t longest = std::numeric_limits<std::int32_t>::max();
  const auto milliseconds =
      static_cast<std::int32_t>(timeout.count() < 0 ? -1 : std::min<std::int64_t>(timeout.count(), longest));
  return request_session_op(path, "MonitorEnter", now, Numbers{&outgoing_, "timeout", milliseconds});
}

RequestId ClientSession::exit_monitor(std::string_view path, Now now) {
  return request_session_op(path, "MonitorExit", now, Numbers{});
}

RequestId ClientSession::lease(std::string_view path, LeaseCommand command, std::chrono::milliseconds deadman,
                               Now now) {
  return request_session_op(path, lease_op, now,
                            Numbers{&outgoing_, "command", static_cast<std::int32_t>(command), "deadman",
                                    static_cast<std::int32_t>(deadman.count())});
}

/// `return` is absent where nothing had to be done; a monitor that is not free yet is asked for again under the same
/// id.
void ClientSession::handle_session_op_reply(const Message& message, const MessageEntry& entry, RequestId id,
                                            std::string path, Now now) {
  const auto* answer = message.elements_of(entry).find("return");
  const auto text = answer && answer->type == DataType::string_t ? answer->text() : std::string_view("OK");
  if (text == "OK") return emit(Completed{id, Value{}});
  const auto command = entry.member_name;
  if (text != "Continue" || (command != "MonitorEnter" && command != monitor_continue_enter))
    return emit(Completed{
        id, protocol_error("the service answered " + quote(command) + " with " + quote(text) + ", expected OK")});
  connection_.begin_message(outgoing_);
  outgoing_.begin_entry(EntryType::client_session_op_req, path, monitor_continue_enter, id);
  if (auto sent = send_outgoing(now); !sent) return emit(Completed{id, sent.error()});
  add_pending(id, EntryType::client_session_op_req, nullptr, path, now);
}

}  // namespace rr
