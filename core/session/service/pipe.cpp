// Pipe endpoints of a service session. Layer: session. Source: sessions spec section 2.11.
#include <algorithm>
#include <utility>

#include "core/member/error_entry.hpp"
#include "core/member/member_table.hpp"
#include "core/session/service/service_session.hpp"

namespace rr {

namespace {

/// Objects come and go: of more members than these nobody remembers which indices were closed.
constexpr std::size_t max_closed_indices = 1000;

/// Which index an endpoint gets beside those in use, as the reference assigns it: the one asked for where it is above
/// all others, else the next above them; never one below, so that an index is not used again while others live. Nor is
/// one up to `closed`: packets of that endpoint may still be on their way.
template <class Indices>
std::optional<std::int32_t> assign_index(std::int32_t asked, const Indices& in_use, std::int32_t closed) {
  const auto last = in_use.empty() ? closed : std::max(closed, in_use.rbegin()->first);
  asked = std::max(asked, any_pipe_index);
  if (last < asked || last == any_pipe_index) return asked == any_pipe_index ? 1 : asked;
  if (last == INT32_MAX) return std::nullopt;
  return last + 1;
}

}  // namespace

// --- asked ---

ServiceSession::ServicePipe* ServiceSession::find_pipe(PipeId id) {
  const auto found = pipes_.find(id);
  return found == pipes_.end() ? nullptr : &found->second;
}

void ServiceSession::forget_pipe(PipeId id) {
  const auto pipe = pipes_.find(id);
  if (pipe == pipes_.end()) return;
  const auto indices = pipe_indices_.find(*pipe->second.key);
  indices->second.erase(pipe->second.index);
  if (indices->second.empty()) pipe_indices_.erase(indices);
  ended().pipes.add(pipe->second.ledger);
  if (pipe->second.state.state() == PipeState::connecting) release_pass(pipe->second.request_id);
  pipes_.erase(pipe);
}

/// An endpoint ends that the other side may still be sending to, or be read from.
void ServiceSession::leave_pipe(PipeId id, PipeEnd by) {
  if (const auto* pipe = find_pipe(id); pipe && pipe->index < INT32_MAX) {
    auto& closed = closed_indices_[*pipe->key];
    auto& highest = by == PipeEnd::service ? closed.by_service : closed.by_client;
    highest = std::max(highest, pipe->index);
    if (closed_indices_.size() > max_closed_indices) closed_indices_.erase(closed_indices_.begin());
  }
  forget_pipe(id);
}

void ServiceSession::accept_pipe(PipeId id, Now now) {
  auto* pipe = find_pipe(id);
  if (!pipe || pipe->state.state() != PipeState::connecting) return;
  pipe->state.open(pipe->is_unreliable,
                   [](PipePacket&&) {});  // nothing was kept: the client does not know the index yet
  connection_.begin_message(outgoing_);
  outgoing_.begin_entry(EntryType::pipe_connect_ret, pipe->key->path, pipe->key->member, pipe->request_id);
  write_pipe_index(outgoing_, pipe->index);
  if (pipe->is_unreliable) write_unreliable(outgoing_);
  send_outgoing(now);
}

void ServiceSession::refuse_pipe(PipeId id, const Error& error, Now now) {
  auto* pipe = find_pipe(id);
  if (!pipe || pipe->state.state() != PipeState::connecting) return;
  const auto request_id = pipe->request_id;
  const auto key = *pipe->key;
  forget_pipe(id);
  connection_.begin_message(outgoing_);
  outgoing_.begin_entry(EntryType::pipe_connect_ret, key.path, key.member, request_id);
  write_own_error(error);
  send_outgoing(now);
}

Result<std::uint32_t> ServiceSession::send_pipe_packet(PipeId id, const Value& value, Now now, bool wants_ack) {
  return send_numbered(id, now, [&](const ServicePipe& pipe, std::uint32_t number) -> Result<> {
    connection_.begin_message(outgoing_);
    begin_pipe_packets(outgoing_, pipe.key->path, pipe.key->member, pipe.is_unreliable);
    if (auto written =
            write_pipe_packet(outgoing_, pipe.index, number, value, wants_ack, pipe.state.member(), service_->types());
        !written)
      return written;
    return connection_.send(outgoing_, now);
  });
}

Result<std::uint32_t> ServiceSession::send_pipe_packet(PipeId id, SharedPipePacket& packet, Now now,
                                                       LentMessage* lent) {
  return send_numbered(id, now, [&](const ServicePipe& pipe, std::uint32_t number) -> Result<> {
    const auto message =
        packet.message(pipe.key->path, pipe.state.member(), pipe.is_unreliable, pipe.index, number, service_->types());
    if (!message) return message.error();
    return connection_.send(**message, now, false, lent);
  });
}

template <class Send>
Result<std::uint32_t> ServiceSession::send_numbered(PipeId id, Now now, Send&& send) {
  auto* pipe = find_pipe(id);
  if (pipe && pipe->state.state() == PipeState::connecting) {
    accept_pipe(id, now);
    pipe = find_pipe(id);
  }
  if (!pipe) return make_error(ErrorCode::invalid_operation, "the pipe endpoint is closed");
  auto& state = pipe->state;
  const auto& member = state.member();
  if (member.direction() == MemberDirection::writeonly)
    return make_error(ErrorCode::write_only_member,
                      "pipe '" + member.name + "' is writeonly: the service sends nothing on it");
  if (queued_bytes() >= options_.max_pipe_queued_bytes)
    return make_error(ErrorCode::out_of_system_resource,
                      "pipe '" + member.name + "': " + std::to_string(queued_bytes()) +
                          " bytes wait for the stream; send again when they are fewer");
  const auto number = state.take_number();
  const Result<> sent = send(*pipe, number);
  if (sent) {
    pipe->ledger.note_delivery({});
    return number;
  }
  state.return_number();
  if (connection_.state() == ConnectionState::closed) leave(sent.error(), now);
  return sent.error();
}

void ServiceSession::acknowledge_pipe(PipeId id, std::span<const std::uint32_t> numbers, Now now) {
  const auto* pipe = find_pipe(id);
  if (!pipe || numbers.empty()) return;
  pipe_acks_.clear();
  for (const auto number : numbers) pipe_acks_.emplace_back(pipe->index, number);
  send_pipe_acks(pipe->key->path, pipe->key->member, pipe->is_unreliable, now);
}

void ServiceSession::close_pipe(PipeId id, Now now) {
  accept_pipe(id, now);
  const auto* pipe = find_pipe(id);
  if (!pipe) return;
  const auto index = pipe->index;
  const auto key = *pipe->key;
  leave_pipe(id, PipeEnd::service);
  connection_.begin_message(outgoing_);
  outgoing_.begin_entry(EntryType::pipe_closed, key.path, key.member);
  write_pipe_index(outgoing_, index);
  send_outgoing(now);
}

void ServiceSession::release_pipes(std::string_view path, const Error& why, Now now) {
  std::vector<PipeId> released;
  for (const auto& [id, pipe] : pipes_)
    if (is_within(pipe.key->path, path)) released.push_back(id);
  for (const auto id : released) {
    refuse_pipe(id, why, now);  // which does nothing to one that is open
    if (is_gone_) return;       // what could not be sent has ended the session
    leave_pipe(id, PipeEnd::service);
    events_.push(PipeClosed{id});
  }
}

// --- received ---

Result<> ServiceSession::connect_pipe(const Message& message, const MessageEntry& entry,
                                      const HostedService::Found& found, const MemberDefinition& member) {
  const auto asked = read_pipe_index_element(message, entry, member);
  if (!asked) return asked.error();
  if (pipes_.size() >= options_.max_pipe_endpoints)
    return make_error(
        ErrorCode::out_of_system_resource,
        "this client has " + std::to_string(options_.max_pipe_endpoints) + " pipe endpoints connected already");
  PathMember key{std::string(entry.service_path), std::string(entry.member_name)};
  const auto indices = pipe_indices_.try_emplace(std::move(key)).first;
  const auto found_closed = closed_indices_.find(indices->first);
  const auto closed = found_closed == closed_indices_.end() ? ClosedIndices{} : found_closed->second;
  // Who closes an endpoint and names its index again wants that one.
  const auto index =
      assign_index(*asked, indices->second,
                   *asked == any_pipe_index ? std::max(closed.by_service, closed.by_client) : closed.by_service);
  if (!index)
    return make_error(ErrorCode::out_of_range, "pipe '" + member.name + "': there is no index above those in use");
  const auto id = ++last_pipe_id_;
  const bool is_unreliable = found.type->is_unreliable_pipe(member) && reads_unreliable(message, entry);
  auto& pipe = pipes_.try_emplace(id, member, pipe_store_).first->second;
  pipe.id = id;
  pipe.key = &indices->first;
  pipe.index = *index;
  pipe.request_id = entry.request_id;
  pipe.is_unreliable = is_unreliable;
  indices->second.emplace(*index, &pipe);
  events_.push(PipeConnected{id, found.object, &member, *index});
  return {};
}

ServiceSession::ServicePipe* ServiceSession::find_pipe(const MessageEntry& entry, std::int32_t index) {
  const auto indices = pipe_indices_.find(PathMemberView{entry.service_path, entry.member_name});
  if (indices == pipe_indices_.end()) return nullptr;
  const auto found = indices->second.find(index);
  return found == indices->second.end() || found->second->state.state() != PipeState::open ? nullptr : found->second;
}

Result<> ServiceSession::disconnect_pipe(const Message& message, const MessageEntry& entry,
                                         const MemberDefinition& member, Now now) {
  const auto index = read_pipe_index_element(message, entry, member);
  if (!index) return index.error();
  const auto* pipe = find_pipe(entry, *index);
  if (!pipe) return make_error(ErrorCode::invalid_argument, "Invalid pipe");
  const auto id = pipe->id;
  leave_pipe(id, PipeEnd::client);
  events_.push(PipeClosed{id});
  begin_reply(entry);
  send_outgoing(now);
  return {};
}

void ServiceSession::handle_pipe_packets(const Message& message, const MessageEntry& entry, Now now) {
  if (entry.error != ErrorCode::none) return;
  pipe_acks_.clear();
  std::vector<PipeId> broken;
  bool is_unreliable = false;
  for (const auto& element : message.elements_of(entry)) {
    const auto index = read_pipe_index(element);
    auto* pipe = index ? find_pipe(entry, *index) : nullptr;
    if (!pipe) continue;
    if (!admit(entry.type, entry.service_path, &pipe->state.member())) {
      broken.push_back(pipe->id);
      continue;
    }
    is_unreliable = is_unreliable || pipe->is_unreliable;
    if (!handle_pipe_packet(message, element, *pipe)) broken.push_back(pipe->id);
  }
  if (!pipe_acks_.empty()) send_pipe_acks(entry.service_path, entry.member_name, is_unreliable, now);
  // A packet that is lost, or cannot be read, cannot be made up for: the endpoint ends, and both sides know.
  for (const auto id : broken) {
    if (!find_pipe(id)) continue;
    events_.push(PipeClosed{id});
    close_pipe(id, now);
  }
}

Result<> ServiceSession::handle_pipe_packet(const Message& message, const MessageElement& element, ServicePipe& pipe) {
  const auto& member = pipe.state.member();
  auto packet = read_pipe_packet_head(message, element, member);
  if (!packet) return packet.error();
  const bool is_for_remote = service_->is_remote() && member.direction() != MemberDirection::readonly;
  if (packet->wants_ack && !is_for_remote) pipe_acks_.emplace_back(pipe.index, packet->number);
  if (member.direction() == MemberDirection::readonly) return {};
  if (auto read = read_pipe_packet_value(message, element, member, service_->types(), *packet); !read) return read;
  return pipe.state.receive(std::move(*packet), [&](PipePacket&& due) {
    PipeReceived received{pipe.id, std::move(due.value)};
    if (due.wants_ack && is_for_remote) received.wants_ack = due.number;
    events_.push(std::move(received));
  });
}

void ServiceSession::send_pipe_acks(std::string_view path, std::string_view member, bool is_unreliable, Now now) {
  connection_.begin_message(outgoing_);
  if (is_unreliable) outgoing_.header.metadata = unreliable_metadata;
  outgoing_.begin_entry(EntryType::pipe_packet_ret, path, member);
  for (const auto& [index, number] : pipe_acks_) write_pipe_ack(outgoing_, index, number);
  send_outgoing(now);
}

void ServiceSession::handle_pipe_acks(const Message& message, const MessageEntry& entry) {
  if (entry.error != ErrorCode::none) return;
  for (const auto& element : message.elements_of(entry)) {
    const auto index = read_pipe_index(element);
    const auto* pipe = index ? find_pipe(entry, *index) : nullptr;
    if (!pipe) continue;
    if (auto numbers = read_pipe_ack(element)) events_.push(PipeAcknowledged{pipe->id, std::move(*numbers)});
  }
}

}  // namespace rr
