#include "core/session/client/client_session.hpp"

#include <algorithm>
#include <utility>

#include "core/member/arguments.hpp"
#include "core/member/error_entry.hpp"
#include "core/member/member_table.hpp"
#include "core/support/random.hpp"
#include "core/support/sort.hpp"

namespace rr {

namespace {

constexpr std::chrono::seconds keep_alive_period{60};
constexpr std::chrono::milliseconds disconnect_timeout{500};
/// For so long a connect reply that comes too late for its request still closes the pipe endpoint that it names.
constexpr std::chrono::seconds late_reply_period{60};

bool is_reply(EntryType type) {
  // RobotRaconteurWeb answers that an endpoint is closed with the request's own type. No service asks for it.
  if (type == EntryType::pipe_disconnect_req) return true;
  const auto code = static_cast<std::uint16_t>(type);
  return code % 2 == 0 && code > 100 && type != EntryType::pipe_packet_ret && type != EntryType::wire_packet_ret;
}

Error connection_error(std::string message) {
  return {ErrorCode::connection_error, std::move(message)};
}

}  // namespace

ClientSession::ClientSession(ClientOptions options, Now now)
    : options_(std::move(options)),
      connection_(ConnectionRole::client, options_.connection, now),
      opened_(now.steady),
      last_sent_(now.steady),
      endpoint_(random_endpoint()) {
  if (connection_.state() == ConnectionState::closed) fail(connection_.close_reason());
}

// --- told ---

std::size_t ClientSession::handle_bytes(ByteSpan input, Now now) {
  const auto size = input.size();
  while (!input.empty() && state_ != ClientState::closed) {
    const auto consumed = connection_.receive(input, now);
    if (!consumed) {
      fail(consumed.error());
      break;
    }
    input = input.subspan(*consumed);
    if (!has_started_ && connection_.state() == ConnectionState::open) start_session(now);
    if (const auto* message = connection_.message()) handle_message(*message, now);
    connection_.release_message();
  }
  return size;
}

void ClientSession::handle_transmitted(std::size_t bytes, Now now) {
  connection_.handle_transmitted(bytes, now);
  if (connection_.queued_bytes() < wire_high_mark) flush_wires(now);
}

void ClientSession::handle_closed(Error reason, Now) {
  fail(std::move(reason));
}

void ClientSession::handle_timeout(Now now) {
  if (state_ == ClientState::closed) return;
  if (auto alive = connection_.handle_timeout(now); !alive) return fail(alive.error());
  if (state_ == ClientState::connecting && now.steady - opened_ >= options_.connect_timeout)
    return fail(connection_error("the service " + quote(options_.service) + " did not answer in time"));
  if (now.steady >= closing_deadline_) return fail(connection_error("closed by this side"));
  scan_deadlines(now);
  if (state_ == ClientState::connected && now.steady - last_sent_ >= keep_alive_period) {
    connection_.begin_message(outgoing_);
    outgoing_.begin_entry(EntryType::client_keep_alive_req, options_.service, {});
    if (auto sent = send_outgoing(now); !sent) fail(sent.error());
  }
}

TimePoint ClientSession::poll_timeout() const {
  if (state_ == ClientState::closed) return TimePoint::max();
  auto next = std::min({connection_.poll_timeout(), earliest_deadline_, closing_deadline_});
  if (state_ == ClientState::connecting) next = std::min(next, opened_ + options_.connect_timeout);
  if (state_ == ClientState::connected) next = std::min(next, last_sent_ + keep_alive_period);
  return next;
}

std::optional<ClientEvent> ClientSession::poll_event() {
  return events_.poll();
}

void ClientSession::scan_deadlines(Now now) {
  if (now.steady < earliest_deadline_) return;
  std::vector<RequestId> expired;
  earliest_deadline_ = TimePoint::max();
  for (const auto& [id, pending] : pending_) {
    if (pending.deadline <= now.steady)
      expired.push_back(id);
    else
      earliest_deadline_ = std::min(earliest_deadline_, pending.deadline);
  }
  for (const auto id : expired) {
    const auto found = pending_.find(id);
    if (found == pending_.end()) continue;
    const auto member = found->second.member ? "'" + found->second.member->name + "'" : std::string("the service");
    auto error = make_error(ErrorCode::request_timeout, "no answer from " + member + " in time");
    if (found->second.is_abandoned) {
      if (found->second.member) end_pipe_request(found->second);
      pending_.erase(found);
      continue;
    }
    const auto fetch = std::move(found->second.fetch);
    if (!abandon_request(id, now.steady + late_reply_period)) pending_.erase(found);
    if (fetch) {
      fail_fetch(*fetch, std::move(error));
    } else if (state_ == ClientState::connecting) {
      return fail(connection_error("connect to " + quote(options_.service) + ": " + error.message));
    } else {
      emit(Completed{id, std::move(error)});
    }
  }
}

// --- asked ---

Result<const MemberDefinition*> ClientSession::find_member(std::string_view path, std::string_view member,
                                                           MemberKind kind) const {
  if (state_ != ClientState::connected) return not_connected();
  const auto* type = object_type(path);
  if (!type) return make_error(ErrorCode::object_not_found, "object " + quote(path) + " was not looked up");
  const auto* definition = type->find_member(member);
  if (!definition)
    return make_error(ErrorCode::member_not_found, "object type " + type->name + " has no member " + quote(member));
  if (definition->kind != kind)
    return make_error(ErrorCode::member_not_found, "member " + quote(member) + " is a " +
                                                       std::string(member_kind_name(definition->kind)) + ", not a " +
                                                       std::string(member_kind_name(kind)));
  return definition;
}

Error ClientSession::object_replaced(std::string_view path) {
  return make_error(ErrorCode::object_not_found, "object " + quote(path) + " was replaced");
}

Error ClientSession::not_connected() const {
  return connection_error(state_ == ClientState::connecting ? "the session is not connected yet"
                                                            : connection_.close_reason().message);
}

const EntityDefinition* ClientSession::object_type(std::string_view path) const {
  const auto found = objects_.find(path);
  return found == objects_.end() ? nullptr : found->second;
}

RequestId ClientSession::next_request_id() {
  do {
    ++last_request_id_;
  } while (last_request_id_ == 0 || pending_.contains(last_request_id_));
  return last_request_id_;
}

RequestId ClientSession::begin_request(EntryType type, std::string_view path, std::string_view member) {
  const auto id = next_request_id();
  connection_.begin_message(outgoing_);
  outgoing_.begin_entry(type, path, member, id);
  return id;
}

void ClientSession::add_pending(RequestId id, EntryType type, const MemberDefinition* member, std::string_view path,
                                Now now) {
  const auto deadline = now.steady + options_.request_timeout;
  earliest_deadline_ = std::min(earliest_deadline_, deadline);
  spare_pending_.insert(pending_, id, Pending{type, member, std::string(path), deadline});
}

RequestId ClientSession::fail_request(RequestId id, Error error) {
  emit(Completed{id, std::move(error)});
  return id;
}

template <class Write>
RequestId ClientSession::request(EntryType type, MemberKind kind, std::string_view path, std::string_view member,
                                 Now now, Write&& write) {
  const auto definition = find_member(path, member, kind);
  if (!definition) return fail_request(next_request_id(), definition.error());
  if (auto allowed = check_direction(type, **definition); !allowed)
    return fail_request(next_request_id(), allowed.error());
  const auto id = begin_request(type, path, member);
  if (auto written = write(**definition); !written) return fail_request(id, written.error());
  const bool is_urgent = is_urgent_ || (*definition)->has_modifier("urgent");
  if (auto sent = send_outgoing(now, is_urgent); !sent) return fail_request(id, sent.error());
  const bool has_state = kind == MemberKind::wire || kind == MemberKind::pipe || (*definition)->is_generator();
  add_pending(id, type, *definition, has_state ? path : std::string_view{}, now);
  return id;
}

RequestId ClientSession::request_pipe(EntryType type, std::string_view path, std::string_view member,
                                      std::int32_t index, Now now) {
  return request(type, MemberKind::pipe, path, member, now, [&](const MemberDefinition& definition) -> Result<> {
    write_pipe_index(outgoing_, index);
    if (type == EntryType::pipe_connect_req && object_type(path)->is_unreliable_pipe(definition))
      write_unreliable(outgoing_);
    return {};
  });
}

RequestId ClientSession::request_elements(EntryType type, MemberKind kind, std::string_view path,
                                          std::string_view member, Now now,
                                          const std::function<Result<>(const MemberDefinition&)>& write) {
  return request(type, kind, path, member, now, write);
}

RequestId ClientSession::get_property(std::string_view path, std::string_view member, Now now) {
  return request(EntryType::property_get_req, MemberKind::property, path, member, now,
                 [](const MemberDefinition&) -> Result<> { return {}; });
}

RequestId ClientSession::set_property(std::string_view path, std::string_view member, const Value& value, Now now) {
  return request(
      EntryType::property_set_req, MemberKind::property, path, member, now,
      [&](const MemberDefinition& definition) { return write_property(outgoing_, value, definition, types_); });
}

RequestId ClientSession::call_function(std::string_view path, std::string_view member, std::span<const Value> arguments,
                                       Now now) {
  return request(EntryType::function_call_req, MemberKind::function, path, member, now,
                 [&](const MemberDefinition& definition) -> Result<> {
                   if (definition.is_generator())
                     return make_error(ErrorCode::invalid_operation,
                                       "'" + definition.name + "' is a generator function: use open_generator");
                   return write_arguments(outgoing_, arguments, definition, types_);
                 });
}

RequestId ClientSession::find_object(std::string_view path, Now now) {
  if (state_ != ClientState::connected) return fail_request(next_request_id(), connection_.close_reason());
  if (const auto* type = object_type(path)) {
    const auto id = next_request_id();
    emit(Completed{id, Value(type->qualified_name)});
    return id;
  }
  const auto id = begin_request(EntryType::object_type_name, path, {});
  outgoing_.add_text("clientversion", protocol_level);
  if (auto sent = send_outgoing(now); !sent) return fail_request(id, sent.error());
  add_pending(id, EntryType::object_type_name, nullptr, path, now);
  return id;
}

void ClientSession::cancel(RequestId id) {
  if (const auto found = pending_.find(id);
      found != pending_.end() && abandon_request(id, found->second.deadline + late_reply_period))
    return;
  if (pending_.erase(id) > 0) return;
  std::erase_if(pending_, [id](const auto& each) { return each.second.fetch && each.second.fetch->lookup == id; });
}

void ClientSession::disconnect(Now now) {
  if (state_ == ClientState::closed || state_ == ClientState::closing) return;
  if (state_ == ClientState::connecting) return fail(connection_error("closed by this side"));
  for (auto& [key, wire] : wires_) send_waiting_value(key, wire, now);
  const auto id = begin_request(EntryType::disconnect_client, {}, {});
  outgoing_.add_text("servicename", options_.service);
  if (auto sent = send_outgoing(now); !sent) return fail(sent.error());
  add_pending(id, EntryType::disconnect_client, nullptr, {}, now);
  state_ = ClientState::closing;
  closing_deadline_ = now.steady + disconnect_timeout;
}

Result<> ClientSession::send_outgoing(Now now, bool is_urgent) {
  last_sent_ = now.steady;
  return connection_.send(outgoing_, now, is_urgent);
}

// --- received ---

void ClientSession::handle_message(const Message& message, Now now) {
  for (const auto& entry : message.entries) {
    if (state_ == ClientState::closed) return;
    handle_entry(message, entry, now);
  }
}

void ClientSession::handle_entry(const Message& message, const MessageEntry& entry, Now now) {
  const bool is_for_session = message.header.receiver_endpoint == endpoint_;
  if (entry.error == ErrorCode::invalid_endpoint && is_for_session)
    return fail(connection_error("the service does not know this session any more"));
  if (is_reply(entry.type)) return handle_reply(message, entry, now);
  if (!is_for_session) return;
  switch (entry.type) {
    case EntryType::event_req:
      return handle_event(message, entry);
    case EntryType::wire_packet:
      return handle_wire_packet(message, entry);
    case EntryType::wire_closed:
      return handle_wire_closed(entry);
    case EntryType::pipe_packet:
      return handle_pipe_packets(message, entry, now);
    case EntryType::pipe_packet_ret:
      return handle_pipe_acks(message, entry);
    case EntryType::pipe_closed:
      return handle_pipe_closed(message, entry);
    case EntryType::service_path_released_req:
      return handle_path_released(entry.service_path);
    case EntryType::service_closed:
      return fail(connection_error("the service was closed"));
    case EntryType::callback_call_req:
      return handle_callback(message, entry, now);
    case EntryType::endpoint_check_capability:
      connection_.begin_message(outgoing_);
      outgoing_.begin_entry(reply_type(entry.type), entry.service_path, entry.member_name, entry.request_id);
      outgoing_.add_scalar("return", DataType::uint32_t, std::uint32_t{0});
      if (auto sent = send_outgoing(now); !sent) fail(sent.error());
      return;
    default:
      return;  // packets of members that are not connected
  }
}

void ClientSession::answer_error(const MessageEntry& entry, const Error& error, Now now) {
  connection_.begin_message(outgoing_);
  outgoing_.begin_entry(reply_type(entry.type), entry.service_path, entry.member_name, entry.request_id);
  write_error(outgoing_, error);
  if (auto sent = send_outgoing(now); !sent) fail(sent.error());
}

void ClientSession::handle_reply(const Message& message, const MessageEntry& entry, Now now) {
  // Matched by RequestID alone; late, repeated and unknown replies are dropped.
  auto node = pending_.extract(entry.request_id);
  if (!node) return;
  const auto id = node.key();
  auto pending = spare_pending_.take(std::move(node));
  if (pending.fetch) return handle_fetch_reply(entry, std::move(*pending.fetch), now);
  if (state_ == ClientState::connecting) return handle_connect_reply(entry, pending.type, now);
  if (pending.type == EntryType::disconnect_client) return fail(connection_error("closed by this side"));
  if (pending.type == EntryType::pipe_connect_req || pending.type == EntryType::pipe_disconnect_req)
    return handle_pipe_reply(message, entry, id, pending, now);
  if (pending.is_abandoned) return end_late(message, entry, pending, now);
  if (pending.memory) return handle_memory_reply(message, entry, id, std::move(pending), now);
  if (entry.error != ErrorCode::none) {
    if (pending.type == EntryType::wire_connect_req)
      if (const auto wire = find_connecting_wire(pending, id); wire != wires_.end()) wires_.erase(wire);
    return emit(Completed{id, read_error(message, entry, types_)});
  }
  if (pending.type == EntryType::object_type_name)
    return handle_type_name_reply(entry, id, std::move(pending.path), now);
  if (pending.type == EntryType::client_session_op_req)
    return handle_session_op_reply(message, entry, id, std::move(pending.path), now);
  auto result = read_reply(message, entry, pending);
  const bool is_unread = !result;
  emit(Completed{id, std::move(result), is_unread});
  if (pending.type == EntryType::wire_connect_req) handle_wire_connected(pending, id);
}

Result<Value> ClientSession::read_reply(const Message& message, const MessageEntry& entry,
                                        const Pending& pending) const {
  switch (pending.type) {
    case EntryType::property_get_req:
      return read_property(message, entry, *pending.member, types_);
    case EntryType::function_call_req:
      if (pending.member->is_generator()) {
        const auto index = read_generator_index(message, entry, *pending.member);
        return index ? Result<Value>(Value(*index)) : Result<Value>(index.error());
      }
      return read_return(message, entry, *pending.member, types_);
    case EntryType::generator_next_req:
      return read_generator_return(message, entry, pending.step, *pending.member, types_);
    case EntryType::memory_get_param: {
      auto shape = read_memory_shape(message, entry, *pending.member);
      return shape ? Result<Value>(Value(std::move(*shape))) : Result<Value>(shape.error());
    }
    case EntryType::wire_peek_in_value_req:
    case EntryType::wire_peek_out_value_req: {
      auto read = read_wire_value(message, entry, *pending.member, types_);
      if (!read) return read.error();
      return std::move(read->value);
    }
    case EntryType::get_service_attributes:
      return read_attributes(entry, "return");
    default:
      return Value{};
  }
}

void ClientSession::handle_event(const Message& message, const MessageEntry& entry) {
  const auto* type = object_type(entry.service_path);
  const auto* member = type ? type->find_member(entry.member_name) : nullptr;
  if (!member || member->kind != MemberKind::event) return;  // an object that nobody looked up
  auto arguments = read_arguments(message, entry, *member, types_);
  if (!arguments) return;  // packets that do not fit the definition are dropped, the session lives
  emit(EventReceived{std::string(entry.service_path), std::string(entry.member_name), std::move(*arguments)});
}

void ClientSession::handle_path_released(std::string_view path) {
  if (path == options_.service) return;  // the root cannot be released
  std::erase_if(objects_, [path](const auto& object) { return is_within(object.first, path); });
  std::erase_if(memory_limits_, [path](const auto& memory) { return is_within(memory.first.path, path); });
  for (auto& [id, pending] : pending_) {
    if (pending.fetch && is_within(pending.fetch->path, path))
      pending.fetch->object_type.clear();  // what is there now may be of another type
    if (pending.memory && is_within(pending.memory->path, path))
      pending.memory->stage = MemoryTransfer::Stage::replaced;  // further parts would be those of another object
  }
  release_wires(path);
  release_pipes(path);
  emit(PathReleased{std::string(path)});
}

void ClientSession::fail_unpolled() {
  fail(make_error(ErrorCode::out_of_system_resource,
                  std::to_string(options_.max_events) + " events wait and nobody takes them"));
}

void ClientSession::fail(Error reason) {
  if (state_ == ClientState::closed) return;
  // Requests of the connect sequence are this side's own, as is the one that disconnects: nobody knows their ids.
  const bool is_connecting = state_ == ClientState::connecting;
  state_ = ClientState::closed;
  connection_.close(reason);
  std::vector<RequestId> waiting;
  for (const auto& [id, pending] : pending_)
    if (pending.fetch)
      waiting.push_back(pending.fetch->lookup);
    else if (!is_connecting && !pending.is_abandoned && pending.type != EntryType::disconnect_client)
      waiting.push_back(id);
  rr::sort(waiting);
  pending_.clear();
  callbacks_.clear();
  // Wires and pipes stay, unused: what emits an event may be in the middle of one.
  const Error lost{ErrorCode::connection_error, reason.message};
  for (const auto id : waiting)
    if (id != 0) emit(Completed{id, lost});
  emit(SessionClosed{std::move(reason)});
}

}  // namespace rr
