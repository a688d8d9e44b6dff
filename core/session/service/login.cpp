// How clients log in and out, and what they may do before. Logins are judged outside: the request waits for the answer.
// Layer: session. Source: sessions spec sections 2.3, 2.6, 2.15.
#include <utility>

#include "core/member/error_entry.hpp"
#include "core/session/service/service_session.hpp"

namespace rr {

namespace {

/// What a client may send before it has logged in.
bool is_for_everybody(EntryType type) {
  return type == EntryType::client_session_op_req || type == EntryType::client_keep_alive_req ||
         type == EntryType::endpoint_check_capability;
}

}  // namespace

bool ServiceSession::may_use_service() const {
  return service_ && (!service_->policy().require_valid_user || user_);
}

Result<> ServiceSession::check_login(EntryType type) const {
  if (may_use_service() || is_for_everybody(type)) return {};
  return make_error(ErrorCode::authentication_error, "User is not authenticated");
}

/// The attempt that a request makes with `username` and `credentials`, handed out to be judged.
Result<> ServiceSession::begin_login(const Message& message, const MessageEntry& entry,
                                     std::shared_ptr<HostedService> service, Now now) {
  if (login_) return make_error(ErrorCode::member_busy, "another login of this client is being judged");
  const auto elements = message.elements_of(entry);
  const auto* username = elements.find("username");
  const auto* credentials = elements.find("credentials");
  if (!username || !credentials)
    return make_error(ErrorCode::message_element_not_found,
                      std::string("Element ") + (username ? "credentials" : "username") + " not found.");
  LoginRequested requested;
  if (username->type == DataType::string_t) requested.attempt.username = username->text();
  // What cannot be read is no credential. The reason is not told on: it might quote a secret.
  if (credentials->type == DataType::map_string_t)
    if (auto value = unpack_varvalue(message, *credentials, service->types()))
      requested.attempt.credentials = std::move(*value->get_if<MapString>());
  if (!service->is_remote()) {
    auto ticket = service->login_limit().begin(now);
    if (!ticket) return ticket.error();
    requested.ticket = std::move(*ticket);
  }
  requested.id = ++last_login_id_;
  requested.authenticator = service->policy().authenticator;
  requested.attempt.service = service->name();
  requested.attempt.peer = connection_.peer();
  requested.attempt.verified_node_id = options_.verified_node_id;
  login_ = std::make_unique<OpenLogin>();
  login_->id = requested.id;
  login_->type = entry.type;
  login_->request_id = entry.request_id;
  login_->path = entry.service_path;
  login_->member = entry.member_name;
  login_->service = std::move(service);
  events_.push(std::move(requested));
  return {};
}

void ServiceSession::answer_login(LoginId id, Result<AuthenticatedUser> result, Now now) {
  if (!login_ || login_->id != id || is_gone_) return;
  const OpenLogin login = std::move(*login_);
  login_.reset();
  if (result && result->name.empty())
    result = make_error(ErrorCode::internal_error, "the authenticator returned a user without name");
  if (!result && !is_unjudged(result.error())) {
    if (!login.service->is_remote()) login.service->login_limit().handle_failure(now);
    ++failed_logins_;
  }
  if (login.type == EntryType::connect_client_combined)
    finish_combined(login, std::move(result), now);
  else
    finish_authenticate(login, std::move(result), now);
  if (failed_logins_ >= login.service->policy().max_failed_logins)
    leave(make_error(ErrorCode::authentication_error, "too many logins of this client have failed"), now);
}

void ServiceSession::finish_authenticate(const OpenLogin& login, Result<AuthenticatedUser> result, Now now) {
  if (!service_) return;
  connection_.begin_message(outgoing_);
  outgoing_.begin_entry(reply_type(login.type), login.path, login.member, login.request_id);
  if (result) {
    change_user(std::move(*result), now);
    connection_.authorise();
    outgoing_.add_text("return", "OK");
  } else {
    const auto& error = result.error();
    write_error(outgoing_, is_unjudged(error) ? error : Error{ErrorCode::authentication_error, error.message});
  }
  send_outgoing(now);
}

void ServiceSession::change_user(std::optional<AuthenticatedUser> user, Now now) {
  set_user(std::move(user), now);
  if (service_ && service_->is_remote()) events_.push(UserChanged{});
}

/// ClientSessionOpReq: logins and logouts here, locks and monitors elsewhere.
Result<> ServiceSession::answer_session_op(const Message& message, const MessageEntry& entry, Now now) {
  const auto command = entry.member_name;
  if (service_->is_remote() && command != "AuthenticateUser" && command != "LogoutUser")
    return ask_for_lock(message, entry, now);
  if (command.substr(0, 7) == "Monitor") {
    if (!may_use_service()) return make_error(ErrorCode::authentication_error, "User is not authenticated");
    if (auto admitted = admit(entry.type, entry.service_path, nullptr); !admitted) return admitted;
    return answer_monitor(message, entry, now);
  }
  if (!service_->policy().authenticator)
    return make_error(ErrorCode::invalid_operation, "User authentication not activated for this service");
  if (command == "AuthenticateUser") return begin_login(message, entry, service_, now);
  if (command == "LogoutUser") {
    change_user(std::nullopt, now);
    begin_reply(entry);
    outgoing_.add_text("return", "OK");
    send_outgoing(now);
    return {};
  }
  if (command == "RequestObjectLock" || command == "RequestClientObjectLock" || command == "ReleaseObjectLock") {
    if (auto admitted = admit(entry.type, entry.service_path, nullptr); !admitted) return admitted;
    return answer_object_lock(entry, now);
  }
  if (command == "ReleaseClientObjectLock") return make_error(ErrorCode::invalid_operation, "Invalid command");
  return protocol_error("Invalid ClientSessionOp command");
}

}  // namespace rr
