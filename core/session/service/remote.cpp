// Services whose objects are another node's: requests wait until their object is found, locks are that node's. Layer:
// session. Source: sessions spec sections 2.4, 2.6 and 2.20.
#include <algorithm>
#include <utility>

#include "core/member/error_entry.hpp"
#include "core/session/service/service_index.hpp"
#include "core/session/service/service_session.hpp"

namespace rr {

namespace {

constexpr std::size_t max_open_locks = 64;
constexpr std::size_t max_parked_requests = 64;  ///< for objects that are looked for

/// Session operations that name no object.
bool names_no_object(std::string_view command) {
  return command == "AuthenticateUser" || command == "LogoutUser";
}

/// The numbers of LeaseCommand.
Result<> read_lease_op(const Message& message, const MessageEntry& entry, LockWanted& wanted) {
  const auto elements = message.elements_of(entry);
  const auto number = [&](std::string_view name) -> Result<std::int32_t> {
    const auto* element = elements.find(name);
    if (!element || element->type != DataType::int32_t || element->count != 1)
      return make_error(ErrorCode::data_type_mismatch, "element " + quote(name) + " of a lease: expected one int32");
    return load<std::int32_t>(element->data.data());
  };
  const auto command = number("command");
  if (!command) return command.error();
  const auto deadman = number("deadman");
  if (!deadman) return deadman.error();
  constexpr auto first = static_cast<std::int32_t>(LockCommand::acquire_lease);
  constexpr auto last = static_cast<std::int32_t>(LockCommand::release_lease);
  if (*command < 0 || *command > last - first)
    return make_error(ErrorCode::invalid_argument,
                      "lease command " + std::to_string(*command) + ", expected 0 to " + std::to_string(last - first));
  wanted.command = static_cast<LockCommand>(first + *command);
  wanted.timeout = std::chrono::milliseconds(*deadman);
  return {};
}

}  // namespace

Result<> ServiceSession::admit(EntryType type, std::string_view path, const MemberDefinition* member,
                               const AuthenticatedUser* user) const {
  if (!options_.admit) return {};
  return options_.admit(MemberAccess{type, path, member, user});
}

Result<> ServiceSession::enter(const MessageEntry& entry, const MemberDefinition& member) {
  const bool ends_something = entry.type == EntryType::wire_disconnect_req ||
                              entry.type == EntryType::pipe_disconnect_req ||
                              (entry.type == EntryType::generator_next_req && entry.error != ErrorCode::none);
  if (!options_.enter || ends_something || service_->name() == service_index_name) return {};
  auto pass = options_.enter(MemberAccess{entry.type, entry.service_path, &member, user()});
  if (!pass) return pass.error();
  if (*pass) passes_.emplace(entry.request_id, std::move(*pass));
  return {};
}

std::shared_ptr<RequestPass> ServiceSession::release_pass(std::uint32_t request_id) {
  auto node = passes_.extract(request_id);
  return node ? std::move(node.mapped()) : nullptr;
}

void ServiceSession::answer_pass(const MessageEntry& answer) {
  const auto pass = release_pass(answer.request_id);
  if (!pass) return;
  if (answer.error == ErrorCode::none)
    pass->handle_answer({});
  else if (service_)
    pass->handle_answer(read_error(outgoing_, answer, service_->types()));
}

// --- objects ---

bool ServiceSession::must_wait_for_object(const MessageEntry& entry) const {
  if (!service_->is_remote() || service_->has_object(entry.service_path)) return false;
  switch (entry.type) {
    case EntryType::client_session_op_req:
      return !names_no_object(entry.member_name);
    case EntryType::client_keep_alive_req:
    case EntryType::endpoint_check_capability:
    case EntryType::service_check_capability_req:
      return false;
    default:
      return true;
  }
}

std::size_t ServiceSession::held_bytes() const {
  std::size_t bytes = connection_.held_bytes();
  for (const auto& parked : parked_) bytes += parked.message.size();
  return bytes;
}

Result<> ServiceSession::park(const Message& message, const MessageEntry& entry) {
  if (auto admitted = admit(EntryType::object_type_name, entry.service_path, nullptr); !admitted) return admitted;
  const auto path = parse_service_path(entry.service_path);
  if (!path) return path.error();
  if (path->front().name != service_->name())
    return make_error(ErrorCode::object_not_found,
                      "path " + quote(entry.service_path) + " does not begin with this service");
  // A message is kept whole for each of its requests that waits.
  if (message.entries.size() > max_parked_requests)
    return make_error(ErrorCode::out_of_system_resource,
                      "a message of " + std::to_string(message.entries.size()) +
                          " requests can't wait for its objects to be found, expected at most " +
                          std::to_string(max_parked_requests));
  if (parked_.size() >= max_parked_requests)
    return make_error(
        ErrorCode::out_of_system_resource,
        std::to_string(parked_.size()) + " requests of this client wait for their objects to be found already");
  const auto limit = options_.connection.max_message_size;
  std::size_t held = 0;
  for (const auto& other : parked_) held += other.message.size();
  EncodedMessage encoded;
  if (const auto done = encode(message, {.max_message_size = limit - std::min(limit, held)}, encoded); !done)
    return make_error(ErrorCode::out_of_system_resource,
                      "requests of this client that wait for their objects hold " + std::to_string(held) +
                          " bytes already, expected at most " + std::to_string(limit) + ": " + done.error().message);
  const auto is_same = [&](const ParkedRequest& other) { return other.path == entry.service_path; };
  const bool is_asked = std::any_of(parked_.begin(), parked_.end(), is_same);
  const auto index = static_cast<std::size_t>(&entry - message.entries.data());
  parked_.push_back({std::string(entry.service_path), encoded.to_bytes(), index});
  if (!is_asked) events_.push(ObjectWanted{std::string(entry.service_path)});
  return {};
}

void ServiceSession::handle_object_found(std::string_view path, const Result<>& found, Now now) {
  std::vector<ParkedRequest> ready;
  for (std::size_t i = 0; i < parked_.size();) {
    if (parked_[i].path != path) {
      ++i;
      continue;
    }
    ready.push_back(std::move(parked_[i]));
    parked_.erase(parked_.begin() + static_cast<std::ptrdiff_t>(i));
  }
  Message message;
  for (const auto& request : ready) {
    // Our own bytes: only the client may be gone.
    const DecodeOptions options{.message_limit = options_.connection.max_message_size};
    if (!service_ || !decode(request.message, options, message)) return;
    const auto& entry = message.entries[request.entry];
    if (refuse_reused_id(entry, now)) return;
    if (!found)
      send_error(entry, found.error(), now);
    else if (must_wait_for_object(entry))  // it is not looked for again, which might go on for ever
      send_error(entry,
                 make_error(ErrorCode::object_not_found,
                            "object " + quote(request.path) + " was found, but the service does not have it any more"),
                 now);
    else
      handle_entry(message, entry, now);
  }
}

void ServiceSession::answer_leave(Now now) {
  if (!leaving_ || is_gone_) return;
  outgoing_.clear();
  outgoing_.header.sender_endpoint = endpoint_;
  outgoing_.header.receiver_node_id = leaving_->client.id;
  outgoing_.header.receiver_node_name = leaving_->client.name;
  outgoing_.header.receiver_endpoint = leaving_->client_endpoint;
  outgoing_.begin_entry(EntryType::disconnect_client_ret, leaving_->path, leaving_->member, leaving_->request_id);
  send_outgoing(now);
  leave({ErrorCode::none, "the client disconnected"}, now);
}

// --- locks ---

Result<> ServiceSession::ask_for_lock(const Message& message, const MessageEntry& entry, Now now) {
  const auto command = entry.member_name;
  if (!may_use_service()) return make_error(ErrorCode::authentication_error, "User is not authenticated");
  if (command == "ReleaseClientObjectLock") return make_error(ErrorCode::invalid_operation, "Invalid command");
  if (auto admitted = admit(entry.type, entry.service_path, nullptr); !admitted) return admitted;
  if (command == "MonitorContinueEnter") return continue_entering(entry, now);
  LockWanted wanted;
  if (command == "RequestObjectLock") {
    wanted.command = LockCommand::lock_for_user;
  } else if (command == "RequestClientObjectLock") {
    wanted.command = LockCommand::lock_for_client;
  } else if (command == "ReleaseObjectLock") {
    wanted.command = LockCommand::unlock;
  } else if (command == "MonitorEnter") {
    wanted.command = LockCommand::enter_monitor;
    const auto timeout = read_monitor_timeout(message, entry);
    if (!timeout) return timeout.error();
    wanted.timeout = *timeout;
  } else if (command == "MonitorExit") {
    wanted.command = LockCommand::exit_monitor;
  } else if (command == "rrgate.Lease") {
    if (auto read = read_lease_op(message, entry, wanted); !read) return read;
  } else {
    return protocol_error("Invalid ClientSessionOp command");
  }
  if (locks_.size() >= max_open_locks)
    return make_error(ErrorCode::out_of_system_resource,
                      std::to_string(locks_.size()) + " requests for locks of this client wait already");
  wanted.id = ++last_lock_id_;
  wanted.path = entry.service_path;
  OpenLock lock;
  lock.id = wanted.id;
  lock.request_id = entry.request_id;
  lock.path = wanted.path;
  lock.member = command;
  lock.is_monitor_enter = wanted.command == LockCommand::enter_monitor;
  if (lock.is_monitor_enter) lock.answer_by = now.steady + longest_wait;
  locks_.push_back(std::move(lock));
  events_.push(std::move(wanted));
  return {};
}

Result<> ServiceSession::continue_entering(const MessageEntry& entry, Now now) {
  const auto found = std::find_if(locks_.begin(), locks_.end(), [&](const OpenLock& lock) {
    return lock.is_monitor_enter && !lock.is_asked && lock.path == entry.service_path;
  });
  if (found == locks_.end()) return make_error(ErrorCode::invalid_operation, "Not acquiring monitor lock");
  found->request_id = entry.request_id;
  found->member = entry.member_name;
  found->is_asked = true;
  found->answer_by = now.steady + longest_wait;
  if (found->result) answer_lock(found->id, Result<>(*found->result), now);
  return {};
}

void ServiceSession::answer_lock(LockRequestId id, const Result<>& result, Now now) {
  const auto found = std::find_if(locks_.begin(), locks_.end(), [id](const OpenLock& lock) { return lock.id == id; });
  if (found == locks_.end()) return;
  if (!found->is_asked) {
    found->result = result;
    return;
  }
  const OpenLock lock = std::move(*found);
  locks_.erase(found);
  if (result)
    answer_lock_request(lock, std::string_view("OK"), now);
  else
    answer_lock_request(lock, result.error(), now);
}

void ServiceSession::continue_late_locks(Now now) {
  for (std::size_t i = 0; i < locks_.size(); ++i) {  // an answer that can't be sent ends the session
    if (now.steady < locks_[i].answer_by) continue;
    locks_[i].answer_by = TimePoint::max();
    locks_[i].is_asked = false;
    answer_lock_request(OpenLock(locks_[i]), std::string_view("Continue"), now);
  }
}

}  // namespace rr
