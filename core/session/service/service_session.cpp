#include "core/session/service/service_session.hpp"

#include <algorithm>
#include <utility>

#include "core/member/arguments.hpp"
#include "core/member/error_entry.hpp"
#include "core/member/member_table.hpp"
#include "core/session/service/service_index.hpp"

namespace rr {

namespace {

/// A closed session's last reply gets out before the connection closes.
constexpr std::chrono::milliseconds linger{100};
constexpr std::chrono::seconds endpoint_timeout{600};  ///< without a session message
/// Others find room for theirs. What is forgotten of a remote service is found again where it is asked for.
constexpr std::size_t max_kept_remote_objects = 1024;

bool is_request(EntryType type) {
  return static_cast<std::uint16_t>(type) % 2 == 1;
}

/// Odd entry types that are packets or notices: nothing ever answers them.
bool is_packet(EntryType type) {
  return type == EntryType::wire_packet || type == EntryType::pipe_packet || type == EntryType::event_req ||
         type == EntryType::pipe_closed || type == EntryType::wire_closed ||
         type == EntryType::service_path_released_req;
}

ConnectionOptions with_identity(ConnectionOptions options, const NodeIdentity& identity) {
  options.self = identity;
  return options;
}

}  // namespace

ServiceSession::ServiceSession(ServiceDirectory& directory, ServiceSessionOptions options, Now now)
    : directory_(directory),
      options_(std::move(options)),
      connection_(ConnectionRole::service, with_identity(options_.connection, directory.identity()), now),
      opened_(now.steady),
      last_session_message_(now.steady),
      generators_(options_.max_generators) {}

ServiceSession::~ServiceSession() {
  leave_locks();
  if (endpoint_ != 0 && !is_gone_) directory_.endpoints().give_back(endpoint_, last_session_message_);
}

// --- told ---

std::size_t ServiceSession::handle_bytes(ByteSpan input, Now now) {
  const auto size = input.size();
  while (!input.empty() && takes_requests()) {
    const auto consumed = connection_.receive(input, now);
    if (!consumed) leave(consumed.error(), now);
    if (wants_close()) return size;
    input = input.subspan(*consumed);
    // Requests behind a disconnect get no answer.
    if (const auto* message = connection_.message(); message && !closing_deadline_) handle_message(*message, now);
    connection_.release_message();
  }
  return size - input.size();
}

void ServiceSession::handle_transmitted(std::size_t bytes, Now now) {
  connection_.handle_transmitted(bytes, now);
  if (connection_.queued_bytes() < wire_high_mark) flush_wires(now);
}

void ServiceSession::handle_closed(Error reason, Now now) {
  connection_.close(reason);
  leave(std::move(reason), now);
}

void ServiceSession::handle_timeout(Now now) {
  if (wants_close()) return;
  if (closing_deadline_) {
    if (now.steady >= *closing_deadline_) connection_.close({ErrorCode::connection_error, "session closed"});
    return;
  }
  if (!takes_requests()) connection_.excuse_silence(now);
  if (auto alive = connection_.handle_timeout(now); !alive) return leave(alive.error(), now);
  end_generators(generators_.remove_idle(now));
  handle_locks_changed(now);
  continue_late_locks(now);
  expire_callbacks(now);
  const bool is_late = service_ ? now.steady - last_session_message_ >= endpoint_timeout
                                : now.steady - opened_ >= options_.connect_timeout;
  if (!is_late) return;
  const Error reason{ErrorCode::connection_error,
                     service_ ? "the client sent nothing for too long" : "the client connected to no service in time"};
  connection_.close(reason);
  leave(reason, now);
}

TimePoint ServiceSession::poll_timeout() const {
  if (wants_close()) return TimePoint::max();
  if (closing_deadline_) return *closing_deadline_;
  const auto end = service_ ? last_session_message_ + endpoint_timeout : opened_ + options_.connect_timeout;
  const auto callback = callbacks_.empty() ? TimePoint::max() : callbacks_.begin()->second.deadline;
  auto lock = TimePoint::max();
  for (const auto& open : locks_) lock = std::min(lock, open.answer_by);
  return std::min({connection_.poll_timeout(), generators_.deadline(), next_enter_deadline(), lock, callback, end});
}

std::optional<ServiceEvent> ServiceSession::poll_event() {
  return events_.poll();
}

/// Ends the session; the connection lingers so that the last reply gets out.
void ServiceSession::leave(Error reason, Now now) {
  if (is_gone_) return;
  is_gone_ = true;
  if (endpoint_ != 0) directory_.endpoints().give_back(endpoint_, now.steady);
  closing_deadline_ = now.steady + linger;
  leave_locks();
  service_.reset();
  login_.reset();
  calls_.clear();
  passes_.clear();
  generators_.clear();
  end_all_wires();
  for (const auto& [id, pipe] : pipes_) ended().pipes.add(pipe.ledger);
  pipes_.clear();
  pipe_indices_.clear();
  parked_.clear();
  locks_.clear();
  used_objects_.clear();
  end_callbacks(reason);
  events_.push(ClientGone{std::move(reason)});
}

Ledgers& ServiceSession::ended() {
  if (!ended_) ended_ = std::make_unique<Ledgers>();
  return *ended_;
}

// --- asked ---

void ServiceSession::reply(CallId id, const Result<Value>& result, Now now) {
  // Handlers mostly answer at once: the call is the last one.
  const auto found = std::find_if(calls_.rbegin(), calls_.rend(), [id](const OpenCall& call) { return call.id == id; });
  if (found == calls_.rend() || !service_) return;
  const OpenCall call = std::move(*found);
  calls_.erase(std::next(found).base());
  const auto& types = service_->types();
  const auto begin = [&] {
    connection_.begin_message(outgoing_);
    outgoing_.begin_entry(reply_type(call.type), call.path, call.member->name, call.request_id);
  };
  begin();
  Result<> written;
  if (!result) {
    written = result.error();
  } else {
    switch (call.type) {
      case EntryType::property_get_req:
        written = write_property(outgoing_, *result, *call.member, types);
        break;
      case EntryType::function_call_req:
      case EntryType::generator_next_req:
        written = call.generator != 0 ? write_generator_reply(call, *result, now)
                                      : write_return(outgoing_, *result, *call.member, types);
        break;
      case EntryType::wire_peek_in_value_req:
      case EntryType::wire_peek_out_value_req:
        written = write_wire_value(outgoing_, *result, now.utc, *call.member, types);
        break;
      case EntryType::memory_get_param:
      case EntryType::memory_read:
      case EntryType::memory_write:
        written = write_memory_reply(call, *result);
        break;
      default:
        break;  // property set, poke: the reply has no elements
    }
  }
  if (!written) {
    begin();
    write_own_error(written.error());
  }
  // Behind a gateway, where many share a link, no answer waits for a stream of values.
  send_outgoing(now, call.member->has_modifier("urgent") || service_->is_remote());
  if (call.generator != 0) finish_generator_call(call, !written, now);
}

Result<> ServiceSession::send_event(std::string_view path, const MemberDefinition& member,
                                    std::span<const Value> arguments, Now now) {
  EventPacket packet(path, member, arguments);
  return send_event(packet, now);
}

Result<> ServiceSession::send_event(EventPacket& packet, Now now, LentMessage* lent) {
  if (!service_) return make_error(ErrorCode::connection_error, "no client is connected");
  if (!may_use_service() || !admit(EntryType::event_req, packet.path(), &packet.member())) return {};
  const auto message = packet.message(service_->types());
  if (!message) return message.error();
  auto sent = connection_.send(**message, now, packet.member().has_modifier("urgent"), lent);
  if (!sent && connection_.state() == ConnectionState::closed) leave(sent.error(), now);
  return sent;
}

void ServiceSession::release_path(std::string_view path, Now now) {
  if (!service_) return;
  const auto is_released = [path](std::string_view other) { return is_within(other, path); };
  const auto why = make_error(ErrorCode::object_not_found, "object " + quote(path) + " was replaced");
  release_wires(path, why, now);
  release_pipes(path, why, now);
  end_generators(generators_.remove_released(is_released));
  std::erase_if(used_objects_, [&](const auto& used) { return is_released(used.first); });
  if (!may_use_service()) return;
  connection_.begin_message(outgoing_);
  outgoing_.begin_entry(EntryType::service_path_released_req, path, {});
  send_outgoing(now);
}

void ServiceSession::close_service(Now now) {
  if (!service_) return;
  if (may_use_service()) {
    connection_.begin_message(outgoing_);
    outgoing_.begin_entry(EntryType::service_closed, {}, {});
    send_outgoing(now);
  }
  leave({ErrorCode::none, "the service was closed"}, now);
}

void ServiceSession::send_outgoing(Now now, bool is_urgent) {
  if (!passes_.empty())
    for (const auto& entry : outgoing_.entries)
      if (!is_request(entry.type) && entry.type != EntryType::pipe_packet_ret) answer_pass(entry);
  if (auto sent = connection_.send(outgoing_, now, is_urgent); sent)
    return;
  else if (connection_.state() == ConnectionState::closed)
    leave(sent.error(), now);
  else if (!outgoing_.entries.empty() && outgoing_.entries.front().error == ErrorCode::none &&
           outgoing_.entries.front().request_id != 0) {
    // A reply that cannot be sent (above the size limit) becomes an error, so that the client does not wait in vain.
    const auto entry = outgoing_.entries.front();
    const std::string path(entry.service_path);
    const std::string member(entry.member_name);
    connection_.begin_message(outgoing_);
    outgoing_.begin_entry(entry.type, path, member, entry.request_id);
    write_error(outgoing_, sent.error());
    if (auto second = connection_.send(outgoing_, now); !second) leave(second.error(), now);
  }
}

// --- received ---

void ServiceSession::handle_message(const Message& message, Now now) {
  const auto& first = message.entries.front();
  const bool is_special = static_cast<std::uint16_t>(first.type) < 500;
  const bool is_session_lookup =
      first.type == EntryType::object_type_name && message.entries.size() == 1 && message.header.receiver_endpoint != 0;
  if (is_special && !is_session_lookup) {
    for (const auto& entry : message.entries)
      if (refuse_reused_id(entry, now)) return;
    if (is_request(first.type)) handle_special(message, now);
    return;
  }
  const bool is_ours = is_of_session(message.header);
  if (is_ours) last_session_message_ = now.steady;
  for (const auto& entry : message.entries) {
    if (connection_.is_held_back()) return;
    if (leaving_ && is_ours) return;  // behind a disconnect
    if (refuse_reused_id(entry, now)) return;
    if (!is_ours) {
      if (is_request(entry.type) && !is_packet(entry.type))
        send_error(entry, {ErrorCode::invalid_endpoint, "Invalid destination endpoint"}, now);
    } else if (service_) {
      if (entry.error == ErrorCode::invalid_endpoint) {
        connection_.close({ErrorCode::connection_error, "the client lost its session"});
        return leave(connection_.close_reason(), now);
      }
      handle_entry(message, entry, now);
    }
  }
}

/// What is kept for a request is found by the client's number: a second request of that number would end the first.
bool ServiceSession::refuse_reused_id(const MessageEntry& entry, Now now) {
  if (passes_.empty() || !is_request(entry.type) || is_packet(entry.type) || !passes_.contains(entry.request_id))
    return false;
  connection_.close(protocol_error("request " + std::to_string(entry.request_id) +
                                   " of the client is not answered yet, and it sent another one of that number"));
  leave(connection_.close_reason(), now);
  return true;
}

/// The endpoints must be this connection's, and the sender the node that connected: knowing the number of somebody
/// else's session opens nothing.
bool ServiceSession::is_of_session(const MessageHeader& header) const {
  return service_ && header.receiver_endpoint == endpoint_ && header.sender_endpoint == connection_.remote_endpoint() &&
         header.sender_node_id == client_node_ &&
         (header.receiver_node_id == directory_.identity().id || header.receiver_node_id.is_any());
}

void ServiceSession::handle_entry(const Message& message, const MessageEntry& entry, Now now) {
  if (auto allowed = check_login(entry.type); !allowed) {
    if (is_request(entry.type) && !is_packet(entry.type)) send_error(entry, allowed.error(), now);
    return;
  }
  if (entry.type == EntryType::wire_packet) return handle_wire_packet(message, entry);
  if (entry.type == EntryType::pipe_packet) return handle_pipe_packets(message, entry, now);
  if (entry.type == EntryType::callback_call_ret) return handle_callback_reply(message, entry);
  if (entry.type == EntryType::pipe_packet_ret) return handle_pipe_acks(message, entry);
  if (!is_request(entry.type) || is_packet(entry.type)) return;
  Result<> done;
  if (must_wait_for_object(entry)) {
    done = park(message, entry);
  } else if (find_member_request(entry.type)) {
    done = dispatch_member(message, entry, now);
  } else if (entry.type == EntryType::client_session_op_req) {
    done = answer_session_op(message, entry, now);
  } else {
    begin_reply(entry);
    done = answer_session_request(message, entry);
    if (done) send_outgoing(now);
  }
  if (!done) send_error(entry, done.error(), now);
}

/// Requests to the session itself; the reply is begun.
Result<> ServiceSession::answer_session_request(const Message& message, const MessageEntry& entry) {
  switch (entry.type) {
    case EntryType::client_keep_alive_req:
      return {};
    case EntryType::endpoint_check_capability:
    case EntryType::service_check_capability_req:
      outgoing_.add_scalar("return", DataType::uint32_t, std::uint32_t{0});
      return {};
    case EntryType::object_type_name: {
      if (auto admitted = admit(entry.type, entry.service_path, nullptr); !admitted) return admitted;
      const auto version = read_client_version(message, entry);
      if (!version) return version.error();
      const auto service = service_;  // whose type is named; the application, which is asked, may end the session
      const auto found = find_object(entry.service_path);
      if (!found) return found.error();
      const auto* type = service->type_for_client(*found->type, *version);
      if (!type) return make_error(ErrorCode::object_not_found, "Service requires newer client version");
      begin_reply(entry);  // anew: the application, which was asked, may have had this session send something
      outgoing_.add_text("objecttype", type->qualified_name);
      return {};
    }
    default:
      return protocol_error("Unknown request type");
  }
}

/// The object behind a path, which the service remembers for as long as this client is there; of a remote service so
/// many that no client alone takes all the room. The application, which is asked, may end the session.
Result<HostedService::Found> ServiceSession::find_object(std::string_view path) {
  const auto service = service_;
  auto found = service->find_object(path);
  const bool is_kept = !service->is_remote() || used_objects_.size() < max_kept_remote_objects;
  if (found && service_ && is_kept && path != service->name() && !used_objects_.contains(path))
    used_objects_.emplace(path, service->use_object(path));
  return found;
}

Result<> ServiceSession::dispatch_member(const Message& message, const MessageEntry& entry, Now now) {
  auto found = find_object(entry.service_path);
  if (!found) return found.error();
  if (!service_) return {};  // the application, which was asked, has ended the session
  const auto* member = found->type->find_member(entry.member_name);
  if (!member || member->kind != find_member_request(entry.type)->kind)
    return make_error(ErrorCode::member_not_found,
                      "Member not found: " + found->type->name + " has no " +
                          std::string(member_kind_name(find_member_request(entry.type)->kind)) + " " +
                          quote(entry.member_name));
  if (auto admitted = admit(entry.type, entry.service_path, member); !admitted) return admitted;
  if (auto entered = enter(entry, *member); !entered) return entered;
  if (auto allowed = check_locks(entry, *found, *member, now); !allowed) return allowed;
  if (auto allowed = check_direction(entry.type, *member); !allowed) return allowed;
  switch (entry.type) {
    case EntryType::property_get_req:
      return add_call(message, entry, CallKind::property_get, std::move(*found), *member);
    case EntryType::property_set_req:
      return add_call(message, entry, CallKind::property_set, std::move(*found), *member);
    case EntryType::function_call_req:
      if (service_->name() == service_index_name) return answer_service_index(entry, *member, now);
      if (member->is_generator()) return open_generator(message, entry, std::move(*found), *member);
      return add_call(message, entry, CallKind::function, std::move(*found), *member);
    case EntryType::generator_next_req:
      return step_generator(message, entry, std::move(*found), *member, now);
    case EntryType::memory_get_param:
    case EntryType::memory_read:
    case EntryType::memory_write:
      return answer_memory(message, entry, std::move(*found), *member, now);
    case EntryType::wire_peek_in_value_req:
      return add_call(message, entry, CallKind::peek_in, std::move(*found), *member);
    case EntryType::wire_peek_out_value_req:
      return add_call(message, entry, CallKind::peek_out, std::move(*found), *member);
    case EntryType::wire_poke_out_value_req:
      return add_call(message, entry, CallKind::poke_out, std::move(*found), *member);
    case EntryType::wire_connect_req:
    case EntryType::wire_disconnect_req:
      return answer_wire(entry, *found, *member, now);
    case EntryType::pipe_connect_req:
      return connect_pipe(message, entry, *found, *member);
    case EntryType::pipe_disconnect_req:
      return disconnect_pipe(message, entry, *member, now);
    default:
      return protocol_error("Unknown request type");
  }
}

Result<> ServiceSession::check_room_for_call() const {
  if (calls_.size() < options_.max_open_calls) return {};
  return make_error(ErrorCode::out_of_system_resource,
                    std::to_string(options_.max_open_calls) + " requests of this client wait for an answer already");
}

Result<> ServiceSession::add_call(const Message& message, const MessageEntry& entry, CallKind kind,
                                  HostedService::Found found, const MemberDefinition& member) {
  if (auto room = check_room_for_call(); !room) return room;
  const auto& types = service_->types();
  Called called;
  if (kind == CallKind::property_set) {
    auto value = read_property(message, entry, member, types);
    if (!value) return value.error();
    called.arguments.push_back(std::move(*value));
  } else if (kind == CallKind::function || kind == CallKind::generator_open) {
    auto arguments = read_arguments(message, entry, member, types);
    if (!arguments) return arguments.error();
    called.arguments = std::move(*arguments);
  } else if (kind == CallKind::poke_out) {
    auto value = read_wire_value(message, entry, member, types);
    if (!value) return value.error();
    called.time = value->time;
    called.arguments.push_back(std::move(value->value));
  }
  called.id = ++last_call_id_;
  called.kind = kind;
  called.object = std::move(found.object);
  called.member = &member;
  calls_.push_back({called.id, entry.type, entry.request_id, std::string(entry.service_path), &member});
  events_.push(std::move(called));
  return {};
}

Result<> ServiceSession::answer_service_index(const MessageEntry& entry, const MemberDefinition& member, Now now) {
  const auto answer =
      answer_service_index_call(member.name, directory_, options_.base_url,
                                [this](EntryType type, std::string_view name) { return admits(type, name, nullptr); });
  if (!answer) return answer.error();
  begin_reply(entry);
  if (auto written = write_return(outgoing_, *answer, member, service_->types()); !written) return written;
  send_outgoing(now);
  return {};
}

void ServiceSession::begin_reply(const MessageEntry& request) {
  connection_.begin_message(outgoing_);
  outgoing_.header.sender_endpoint = endpoint_;
  outgoing_.begin_entry(reply_type(request.type), request.service_path, request.member_name, request.request_id);
}

void ServiceSession::write_own_error(const Error& error) {
  if (service_)
    write_error(outgoing_, error, service_->types());
  else
    write_error(outgoing_, error);
}

void ServiceSession::send_error(const MessageEntry& request, const Error& error, Now now) {
  begin_reply(request);
  write_own_error(error);
  send_outgoing(now, service_ && service_->is_remote());
}

}  // namespace rr
