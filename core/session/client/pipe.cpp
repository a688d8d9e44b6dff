// Pipe endpoints of a client session. Layer: session. Source: sessions spec section 2.11.
#include <algorithm>
#include <utility>

#include "core/member/error_entry.hpp"
#include "core/member/member_table.hpp"
#include "core/session/client/client_session.hpp"

namespace rr {

namespace {

/// Endpoints that packets are kept for while a connect is pending; an honest service needs one a connect.
constexpr std::size_t max_unknown_endpoints = 64;

}  // namespace

// --- asked ---

ClientSession::ClientPipe* ClientSession::find_pipe(std::string_view path, std::string_view member) {
  const auto found = pipes_.find(PathMemberView{path, member});
  return found == pipes_.end() ? nullptr : &found->second;
}

RequestId ClientSession::connect_pipe(std::string_view path, std::string_view member, std::int32_t index, Now now) {
  // No index twice: a reference service gives the next endpoint of an index what it still sends to the one before.
  if (index == any_pipe_index && has_closed_pipe_ && last_pipe_index_ < INT32_MAX) index = last_pipe_index_ + 1;
  last_pipe_index_ = std::max({last_pipe_index_, index, 1});
  const auto id = request_pipe(EntryType::pipe_connect_req, path, member, index, now);
  if (const auto found = pending_.find(id); found != pending_.end()) {
    auto& pipe = pipes_[{std::string(path), std::string(member)}];
    pipe.member = found->second.member;
    ++pipe.connects;
  }
  return id;
}

RequestId ClientSession::disconnect_pipe(std::string_view path, std::string_view member, std::int32_t index, Now now) {
  auto* pipe = find_pipe(path, member);
  const auto endpoint = pipe ? pipe->endpoints.find(index) : decltype(pipe->endpoints.end()){};
  if (state_ == ClientState::connected &&
      (!pipe || endpoint == pipe->endpoints.end() || endpoint->second.state() != PipeState::open)) {
    const auto id = next_request_id();
    emit(Completed{id, Value{}});
    return id;
  }
  const auto id = request_pipe(EntryType::pipe_disconnect_req, path, member, index, now);
  if (const auto found = pending_.find(id); found != pending_.end()) {
    found->second.pipe_index = index;
    has_closed_pipe_ = true;
    endpoint->second.start_closing();
  }
  return id;
}

Result<std::uint32_t> ClientSession::send_pipe_packet(std::string_view path, std::string_view member,
                                                      std::int32_t index, const Value& value, Now now, bool wants_ack) {
  const auto pipe = pipes_.find(PathMemberView{path, member});
  const auto endpoint =
      pipe == pipes_.end() ? decltype(pipe->second.endpoints.end()){} : pipe->second.endpoints.find(index);
  if (state_ == ClientState::closed || pipe == pipes_.end() || endpoint == pipe->second.endpoints.end() ||
      endpoint->second.state() != PipeState::open)
    return make_error(ErrorCode::invalid_operation,
                      "pipe " + quote(member) + ": endpoint " + std::to_string(index) + " is not connected");
  auto& state = endpoint->second;
  if (auto allowed = check_direction(EntryType::pipe_packet, state.member()); !allowed) return allowed.error();
  if (queued_bytes() >= options_.max_pipe_queued_bytes)
    return make_error(ErrorCode::out_of_system_resource,
                      "pipe " + quote(member) + ": " + std::to_string(queued_bytes()) +
                          " bytes wait for the stream; send again when they are fewer");
  connection_.begin_message(outgoing_);
  begin_pipe_packets(outgoing_, pipe->first.path, pipe->first.member, state.is_unreliable());
  const auto number = state.take_number();
  Result<> sent = write_pipe_packet(outgoing_, index, number, value, wants_ack, state.member(), types_);
  if (sent) sent = send_outgoing(now);
  if (sent) return number;
  state.return_number();
  return sent.error();
}

void ClientSession::hold_pipe_acks(std::string_view path, std::string_view member, std::int32_t index, bool is_held,
                                   Now now) {
  auto* pipe = find_pipe(path, member);
  if (!pipe || state_ == ClientState::closed) return;
  const auto found = pipe->endpoints.find(index);
  if (found == pipe->endpoints.end() || found->second.state() != PipeState::open) return;
  auto& endpoint = found->second;
  endpoint.holds_acks = is_held;
  if (is_held || endpoint.held_acks.empty()) return;
  pipe_acks_.clear();
  for (const auto number : endpoint.held_acks) pipe_acks_.emplace_back(index, number);
  endpoint.held_acks.clear();
  send_pipe_acks(path, member, endpoint.is_unreliable(), now);
}

// --- received ---

void ClientSession::handle_pipe_reply(const Message& message, const MessageEntry& entry, RequestId id,
                                      const Pending& pending, Now now) {
  if (pending.type == EntryType::pipe_connect_req) {
    auto opened = entry.error == ErrorCode::none ? open_pipe(message, entry, id, pending, now)
                                                 : Result<std::int32_t>(read_error(message, entry, types_));
    if (!opened && !pending.is_abandoned) emit(Completed{id, opened.error()});
    return end_pipe_request(pending);
  }
  end_pipe_request(pending);
  if (pending.is_abandoned) return;
  // The service may have closed the endpoint while the request was on its way: it is closed, which is what was wanted.
  if (entry.error == ErrorCode::none || entry.error == ErrorCode::invalid_argument) return emit(Completed{id, Value{}});
  emit(Completed{id, read_error(message, entry, types_)});
}

/// Opens the endpoint that a connect reply names: first its completion, then the packets that came before.
Result<std::int32_t> ClientSession::open_pipe(const Message& message, const MessageEntry& entry, RequestId id,
                                              const Pending& pending, Now now) {
  const auto index = read_pipe_index_element(message, entry, *pending.member);
  if (!index) return index;
  last_pipe_index_ = std::max(last_pipe_index_, *index);
  auto* pipe = find_pipe(pending.path, pending.member->name);
  if (!pipe || pending.is_abandoned) {
    // What it sends meanwhile must not reach the next endpoint of this index.
    if (pipe)
      pipe->endpoints.try_emplace(*index, *pending.member, pipe_store_, PipeState::closing)
          .first->second.start_closing();
    request_silent_disconnect(pending.path, *pending.member, *index, now);
    return object_replaced(pending.path);
  }
  // Replies may overtake one another: the index of an endpoint that is being closed may be free again already.
  if (const auto old = pipe->endpoints.find(*index);
      old != pipe->endpoints.end() && old->second.state() == PipeState::closing)
    pipe->endpoints.erase(old);
  auto& endpoint =
      pipe->endpoints.try_emplace(*index, *pending.member, pipe_store_, PipeState::connecting).first->second;
  if (endpoint.state() != PipeState::connecting)
    return protocol_error("pipe '" + pending.member->name + "': the service gave the index " + std::to_string(*index) +
                          ", which is in use");
  emit(Completed{id, Value(*index)});
  endpoint.open(reads_unreliable(message, entry), [&](PipePacket&& packet) {
    deliver_pipe_packet(pending.path, pending.member->name, *index, std::move(packet.value));
  });
  if (std::erase(pipe->closed_early, *index) > 0) {
    pipe->endpoints.erase(*index);
    tell_pipe_closed(pending.path, pending.member->name, *index);
  }
  return index;
}

/// A connect or disconnect is not pending any more. What was kept for a connect and did not become its endpoint is
/// dropped.
void ClientSession::end_pipe_request(const Pending& pending) {
  const auto found = pipes_.find(PathMemberView{pending.path, pending.member->name});
  if (found == pipes_.end()) return;
  auto& pipe = found->second;
  if (pending.type == EntryType::pipe_connect_req) {
    --pipe.connects;
  } else if (const auto endpoint = pipe.endpoints.find(pending.pipe_index);
             endpoint != pipe.endpoints.end() && endpoint->second.state() == PipeState::closing) {
    pipe.endpoints.erase(endpoint);
  }
  if (pipe.connects > 0) return;
  pipe.closed_early.clear();
  std::erase_if(pipe.endpoints, [](const auto& item) { return item.second.state() == PipeState::connecting; });
  if (pipe.endpoints.empty()) pipes_.erase(found);
}

/// A reply that comes later and brings what lasts must end it again, a disconnect must free its index: the request
/// stays, though nobody waits for it. Returns whether `id` is such a request.
bool ClientSession::abandon_request(RequestId id, TimePoint deadline) {
  const auto found = pending_.find(id);
  if (found == pending_.end()) return false;
  auto& pending = found->second;
  if (pending.type == EntryType::wire_connect_req) {
    if (const auto wire = find_connecting_wire(pending, id); wire != wires_.end()) wires_.erase(wire);
  } else if (pending.type != EntryType::pipe_connect_req && pending.type != EntryType::pipe_disconnect_req &&
             pending.type != EntryType::client_session_op_req &&
             (pending.type != EntryType::function_call_req || pending.path.empty())) {
    return false;
  }
  pending.is_abandoned = true;
  pending.deadline = deadline;
  earliest_deadline_ = std::min(earliest_deadline_, deadline);
  return true;
}

void ClientSession::request_silent_disconnect(const std::string& path, const MemberDefinition& member,
                                              std::int32_t index, Now now) {
  has_closed_pipe_ = true;
  const auto id = begin_request(EntryType::pipe_disconnect_req, path, member.name);
  write_pipe_index(outgoing_, index);
  if (!send_outgoing(now)) return;  // the connection's end is heard of elsewhere
  add_pending(id, EntryType::pipe_disconnect_req, &member, path, now);
  auto& pending = pending_.find(id)->second;
  pending.pipe_index = index;
  pending.is_abandoned = true;
}

void ClientSession::handle_pipe_packets(const Message& message, const MessageEntry& entry, Now now) {
  auto* pipe = find_pipe(entry.service_path, entry.member_name);
  if (!pipe) return;
  pipe_acks_.clear();
  std::vector<std::int32_t> broken;
  bool is_unreliable = false;
  for (const auto& element : message.elements_of(entry)) {
    const auto index = read_pipe_index(element);
    if (!index) continue;
    auto endpoint = pipe->endpoints.find(*index);
    if (endpoint == pipe->endpoints.end()) {
      const auto unknown = std::count_if(pipe->endpoints.begin(), pipe->endpoints.end(),
                                         [](const auto& each) { return each.second.state() == PipeState::connecting; });
      if (pipe->connects == 0 || static_cast<std::size_t>(unknown) >= pipe->connects + max_unknown_endpoints) continue;
      endpoint = pipe->endpoints.try_emplace(*index, *pipe->member, pipe_store_, PipeState::connecting).first;
    }
    if (endpoint->second.is_unreliable()) is_unreliable = true;
    if (!handle_pipe_packet(message, element, entry, endpoint->second, *index)) broken.push_back(*index);
    if (state_ == ClientState::closed) return;
  }
  if (!pipe_acks_.empty()) send_pipe_acks(entry.service_path, entry.member_name, is_unreliable, now);
  if (state_ == ClientState::closed) return;
  // A packet that is lost, or cannot be read, cannot be made up for: the endpoint ends, and both sides know.
  for (const auto index : broken) {
    const auto endpoint = pipe->endpoints.find(index);
    if (endpoint == pipe->endpoints.end() || endpoint->second.state() != PipeState::open) continue;
    endpoint->second.start_closing();
    tell_pipe_closed(entry.service_path, entry.member_name, index);
    request_silent_disconnect(std::string(entry.service_path), *pipe->member, index, now);
  }
}

Result<> ClientSession::handle_pipe_packet(const Message& message, const MessageElement& element,
                                           const MessageEntry& entry, ClientEndpoint& endpoint, std::int32_t index) {
  auto packet = read_pipe_packet_head(message, element, endpoint.member());
  if (!packet) return packet.error();
  if (packet->wants_ack) acknowledge_packet(endpoint, index, packet->number);
  if (endpoint.member().direction() == MemberDirection::writeonly) return {};
  if (auto read = read_pipe_packet_value(message, element, endpoint.member(), types_, *packet); !read) return read;
  return endpoint.receive(std::move(*packet), [&](PipePacket&& due) {
    deliver_pipe_packet(entry.service_path, entry.member_name, index, std::move(due.value));
  });
}

void ClientSession::deliver_pipe_packet(std::string_view path, std::string_view member, std::int32_t index,
                                        Value&& packet) {
  if (state_ == ClientState::closed) return;
  emit(PipePacketReceived{std::string(path), std::string(member), index, std::move(packet)});
}

void ClientSession::tell_pipe_closed(std::string_view path, std::string_view member, std::int32_t index) {
  has_closed_pipe_ = true;
  emit(PipeClosedByService{std::string(path), std::string(member), index});
}

/// A service that does not mind how many are on the way is acknowledged its oldest packet for each that comes.
void ClientSession::acknowledge_packet(ClientEndpoint& endpoint, std::int32_t index, std::uint32_t number) {
  if (!endpoint.holds_acks) {
    pipe_acks_.emplace_back(index, number);
    return;
  }
  auto& held = endpoint.held_acks;
  held.push_back(number);
  if (held.size() <= options_.max_held_acks) return;
  pipe_acks_.emplace_back(index, held.front());
  held.pop_front();
}

void ClientSession::send_pipe_acks(std::string_view path, std::string_view member, bool is_unreliable, Now now) {
  connection_.begin_message(outgoing_);
  if (is_unreliable) outgoing_.header.metadata = unreliable_metadata;
  outgoing_.begin_entry(EntryType::pipe_packet_ret, path, member);
  for (const auto& [index, number] : pipe_acks_) write_pipe_ack(outgoing_, index, number);
  if (auto sent = send_outgoing(now); !sent) fail(sent.error());
}

void ClientSession::handle_pipe_acks(const Message& message, const MessageEntry& entry) {
  auto* pipe = entry.error == ErrorCode::none ? find_pipe(entry.service_path, entry.member_name) : nullptr;
  if (!pipe) return;
  for (const auto& element : message.elements_of(entry)) {
    const auto index = read_pipe_index(element);
    if (!index || !pipe->endpoints.contains(*index)) continue;
    if (auto numbers = read_pipe_ack(element))
      emit(PipePacketsAcknowledged{std::string(entry.service_path), std::string(entry.member_name), *index,
                                   std::move(*numbers)});
  }
}

void ClientSession::handle_pipe_closed(const Message& message, const MessageEntry& entry) {
  const auto found = pipes_.find(PathMemberView{entry.service_path, entry.member_name});
  if (found == pipes_.end()) return;
  auto& pipe = found->second;
  const auto index = read_pipe_index_element(message, entry, *pipe.member);
  if (!index) return;
  const auto endpoint = pipe.endpoints.find(*index);
  const bool is_known = endpoint != pipe.endpoints.end() && endpoint->second.state() != PipeState::connecting;
  if (!is_known) {
    if (pipe.connects > 0 && pipe.closed_early.size() < max_unknown_endpoints) pipe.closed_early.push_back(*index);
    return;
  }
  if (endpoint->second.state() != PipeState::open) return;  // the answer to our own disconnect is on its way
  pipe.endpoints.erase(endpoint);
  tell_pipe_closed(found->first.path, found->first.member, *index);
  if (pipe.endpoints.empty() && pipe.connects == 0) pipes_.erase(found);
}

void ClientSession::release_pipes(std::string_view path) {
  for (auto pipe = pipes_.begin(); pipe != pipes_.end();) {
    if (!is_within(pipe->first.path, path)) {
      ++pipe;
      continue;
    }
    for (const auto& [index, endpoint] : pipe->second.endpoints)
      if (endpoint.state() == PipeState::open) tell_pipe_closed(pipe->first.path, pipe->first.member, index);
    pipe->second.endpoints.clear();
    pipe = pipe->second.connects == 0 ? pipes_.erase(pipe) : std::next(pipe);
  }
}

}  // namespace rr
