// Wires and pipes of an upstream: attached to the device once, handed out to all who have joined. Layer:
// server/upstream.
#include <algorithm>
#include <boost/asio/post.hpp>

#include "node/driver/clocks.hpp"
#include "server/log/log.hpp"
#include "server/upstream/upstream.hpp"

namespace rrgate {

namespace asio = boost::asio;

namespace {

/// Packets of a client that the device has not acknowledged. Above, the gateway does: a client without bounds of its
/// own can't wait for them all.
constexpr std::size_t max_unacknowledged = 4096;

/// Who are sent a value of a wire before everybody else gets a turn.
constexpr std::size_t clients_a_turn = 64;

}  // namespace

// --- wires ---

void Upstream::join_wire(UpstreamClient& client, const std::string& path, const rr::MemberDefinition& member) {
  const auto allowed =
      connection_ ? locks_->check(client, path, member, MemberUse::connect) : rr::Result<>(lost_error());
  if (!has(client)) return;  // it has left, and nobody would take it off again
  if (!allowed) {
    client.answer_wire(path, member, allowed.error());
    return client.close_wire(path, member);  // where it comes with the wire from another session
  }
  const MemberKey key(path, member.name);
  auto& known = wires_[key];
  if (!known) known = std::make_shared<Wire>(path, member);
  const auto wire = known;
  wire->followers.push_back({&client, wire->count});
  if (wire->state == AttachState::attached) {
    client.answer_wire(path, member, {});
    const auto newest = wire->newest;
    if (!newest || !has_joined(client, key)) return;
    rr::WirePacket packet(path, member, newest->value, newest->time, wire->arrived);
    client.receive_wire(packet, rr::read_clocks());
  } else if (wire->followers.size() == 1) {
    attach_wire(key);
  }
}

void Upstream::attach_wire(const MemberKey& key) {
  const auto known = wires_.find(key);
  if (!connection_ || known == wires_.end() || known->second->state != AttachState::detached) return;
  // Who has joined may leave meanwhile, and another one join: that is another wire.
  const auto is_there = [weak = weak_from_this(), key,
                         wire = std::weak_ptr(known->second)]() -> std::shared_ptr<Upstream> {
    auto self = weak.lock();
    if (!self || self->is_lost()) return nullptr;
    const auto found = self->wires_.find(key);
    return found != self->wires_.end() && found->second == wire.lock() ? self : nullptr;
  };
  known->second->state = AttachState::attaching;
  if (!connection_->session().object_type(key.first))  // another session of this service has found it
    return find_object(key.first, [is_there, key](const rr::Result<rr::Value>& found) {
      const auto self = is_there();
      if (!self) return;
      self->wires_.at(key)->state = AttachState::detached;
      if (found) return self->attach_wire(key);
      const auto reason = found.error();
      self->drop_wire(key, &reason);
    });
  const auto weak = weak_from_this();
  auto received = [weak, key](const rr::Value& value, rr::TimeSpec time) {
    if (const auto self = weak.lock()) self->publish_wire(key, value, time);
  };
  auto connected = [is_there, key](const rr::Result<rr::Value>& done) {
    const auto self = is_there();
    if (!self) return;
    if (!done) {
      const auto reason = done.error();
      return self->drop_wire(key, &reason);
    }
    const auto wire = self->wires_.at(key);
    wire->state = AttachState::attached;
    const auto followers = wire->followers;
    for (const auto& follower : followers)
      if (self->has_joined(*follower.client, key)) follower.client->answer_wire(key.first, wire->member, {});
    if (!self->connection_) return;
    // Who has sent it may have lost the right, or the lease, meanwhile.
    if (const auto waiting = std::exchange(wire->out_value, std::nullopt))
      if (!waiting->sender || self->locks_->check_packet(*waiting->sender, key.first, wire->member))
        (void)self->connection_->send_wire(key.first, key.second, waiting->value);
  };
  connection_->on_wire_closed(key.first, key.second, [weak, key] {
    const auto closed = rr::make_error(rr::ErrorCode::service_error, "the device closed the wire");
    if (const auto self = weak.lock()) self->drop_wire(key, &closed);
  });
  connection_->connect_wire(key.first, key.second, std::move(received), std::move(connected));
}

void Upstream::publish_wire(const MemberKey& key, const rr::Value& value, rr::TimeSpec time) {
  const auto found = wires_.find(key);
  if (found == wires_.end()) return;
  auto& wire = *found->second;
  wire.newest = std::make_shared<const rr::WireValue>(rr::WireValue{time, value});
  wire.arrived = std::chrono::steady_clock::now();
  ++wire.count;
  if (!std::exchange(wire.is_due, true)) hand_out_later(found->second);
}

void Upstream::hand_out_later(const std::shared_ptr<Wire>& wire) {
  asio::post(device_->executor(), [weak = weak_from_this(), wire] {
    if (const auto self = weak.lock()) self->hand_out(wire);
  });
}

/// One after the other, each the newest that there is at its turn. Not all at once: one read may bring hundreds of
/// values, of which the last one counts, and everybody else has to get a turn, too.
void Upstream::hand_out(const std::shared_ptr<Wire>& wire) {
  if (!wire->newest) {  // the device was lost meanwhile
    wire->is_due = false;
    return;
  }
  if (!wire->outgoing || wire->outgoing->count != wire->count)
    wire->outgoing.emplace(wire->path, wire->member, wire->newest, wire->arrived, wire->count);
  auto now = rr::read_clocks();
  std::size_t up_to_date = 0;  // in a row
  for (std::size_t sent = 0; sent < clients_a_turn;) {
    auto& followers = wire->followers;  // they may leave while they are sent to
    if (up_to_date >= followers.size()) {
      wire->is_due = false;
      wire->outgoing.reset();
      return;
    }
    wire->next = (wire->next + 1) % followers.size();
    auto& [client, count] = followers[wire->next];
    if (count == wire->count) {
      ++up_to_date;
      continue;
    }
    const auto missed = wire->count - std::exchange(count, wire->count) - 1;
    up_to_date = 0;
    ++sent;
    if (missed > 0) client->note_conflated(wire->path, wire->member, missed);
    now.steady = std::chrono::steady_clock::now();  // a value's age counts up to here
    client->receive_wire(wire->outgoing->packet, now);
  }
  hand_out_later(wire);
}

void Upstream::leave_wire(UpstreamClient& client, const std::string& path, const rr::MemberDefinition& member) {
  const auto found = wires_.find({path, member.name});
  if (found == wires_.end()) return;
  auto& wire = *found->second;
  if (wire.out_value && wire.out_value->sender == &client) wire.out_value.reset();
  auto& followers = wire.followers;
  std::erase_if(followers, [&](const Follower& each) { return each.client == &client; });
  if (!followers.empty()) return;
  wires_.erase(found);
  if (connection_) connection_->disconnect_wire(path, member.name, ignore_result);
}

void Upstream::drop_wire(const MemberKey& key, const rr::Error* reason) {
  const auto dropped = wires_.extract(key);
  if (!dropped) return;
  const auto followers = std::exchange(dropped.mapped()->followers, {});
  if (!reason) return;
  const auto& member = dropped.mapped()->member;
  for (const auto& [client, count] : followers) {
    if (has(*client)) client->answer_wire(key.first, member, *reason);
    if (has(*client)) client->close_wire(key.first, member);
  }
}

bool Upstream::has_joined(const UpstreamClient& client, const MemberKey& key) const {
  const auto found = wires_.find(key);
  if (found == wires_.end()) return false;
  const auto is_it = [&](const Follower& each) { return each.client == &client; };
  return std::ranges::any_of(found->second->followers, is_it);
}

rr::Result<> Upstream::send_wire(UpstreamClient& client, const std::string& path, const rr::MemberDefinition& member,
                                 const rr::Value& value) {
  if (auto allowed = locks_->check_packet(client, path, member); !allowed) return allowed;
  const auto found = wires_.find({path, member.name});
  if (found == wires_.end()) return {};
  if (connection_ && found->second->state == AttachState::attached)
    return connection_->send_wire(path, member.name, value);
  found->second->out_value = OutValue{&client, value};
  return {};
}

// --- pipes ---

void Upstream::join_pipe(UpstreamClient& client, rr::PipeId id, const std::string& path,
                         const rr::MemberDefinition& member) {
  const auto allowed =
      connection_ ? locks_->check(client, path, member, MemberUse::connect) : rr::Result<>(lost_error());
  if (!has(client)) return;
  if (!allowed) {
    client.refuse_pipe(id, allowed.error());
    return client.close_pipe(id);  // where it comes with the endpoint from another session
  }
  const EndpointKey endpoint(&client, id);
  const bool is_shared = member.direction() == rr::MemberDirection::readonly;
  const MemberKey key(path, member.name);
  if (is_shared) {
    if (const auto known = shared_pipes_.find(key); known != shared_pipes_.end()) {
      const auto number = known->second;
      auto& pipe = pipes_.at(number);
      pipe.endpoints.push_back(endpoint);
      endpoints_[endpoint] = number;
      if (pipe.state == AttachState::attached) client.accept_pipe(id);
      return pace_pipe(number);
    }
  }
  const auto number = ++last_pipe_;
  auto& pipe = pipes_[number];
  pipe.path = path;
  pipe.member = member;
  pipe.endpoints.push_back(endpoint);
  endpoints_[endpoint] = number;
  if (is_shared) shared_pipes_[key] = number;
  attach_pipe(number);
}

void Upstream::attach_pipe(PipeNumber number) {
  const auto found = pipes_.find(number);
  if (found == pipes_.end() || !connection_ || found->second.state != AttachState::detached) return;
  auto& pipe = found->second;
  const auto weak = weak_from_this();
  if (!connection_->session().object_type(pipe.path))  // another session of this service has found it
    return find_object(pipe.path, [weak, number](const rr::Result<rr::Value>& object) {
      const auto self = weak.lock();
      if (!self || self->is_lost()) return;
      if (object) return self->attach_pipe(number);
      self->drop_pipe(number);
    });
  pipe.state = AttachState::attaching;
  rr::ClientConnection::PipeHandlers handlers;
  handlers.received = [weak, number](const rr::Value& packet) {
    const auto self = weak.lock();
    if (!self) return;
    const auto at = self->pipes_.find(number);
    if (at == self->pipes_.end()) return;
    const auto endpoints = at->second.endpoints;  // they may leave
    const auto left = self->endpoints_left_;
    rr::SharedPipePacket shared(packet);
    const auto now = rr::read_clocks();
    for (const auto& endpoint : endpoints)
      if (self->endpoints_left_ == left || self->endpoints_.contains(endpoint))
        endpoint.first->receive_packet(endpoint.second, shared, now);
  };
  handlers.acknowledged = [weak, number](std::span<const std::uint32_t> numbers) {
    if (const auto self = weak.lock()) self->pass_back_acks(number, numbers);
  };
  handlers.closed = [weak, number] {
    if (const auto self = weak.lock()) self->drop_pipe(number);
  };
  const bool is_first = pipe.index == 0;
  connection_->connect_pipe(
      pipe.path, pipe.member.name, rr::any_pipe_index, std::move(handlers),
      [weak, number, is_first, path = pipe.path, member = pipe.member.name](const rr::Result<rr::Value>& result) {
        const auto self = weak.lock();
        if (self) self->pipe_attached(number, path, member, result, is_first);
      });
}

void Upstream::pipe_attached(PipeNumber number, const std::string& path, const std::string& member,
                             const rr::Result<rr::Value>& result, bool is_first) {
  const auto found = pipes_.find(number);
  if (found == pipes_.end()) {  // everybody has left meanwhile
    if (result && connection_)
      connection_->disconnect_pipe(path, member, result->to<std::int32_t>().value(), ignore_result);
    return;
  }
  auto& pipe = found->second;
  if (!result) {
    if (!is_first && is_lost()) return;  // again: the next attempt will do
    const auto endpoints = pipe.endpoints;
    if (!is_first) return drop_pipe(number);
    for (const auto& endpoint : endpoints) end_endpoint(endpoint);
    shared_pipes_.erase({pipe.path, pipe.member.name});
    pipes_.erase(found);
    for (const auto& endpoint : endpoints)
      if (has(*endpoint.first)) endpoint.first->refuse_pipe(endpoint.second, result.error());
    for (const auto& endpoint : endpoints)  // of who came with it from another session
      if (has(*endpoint.first)) endpoint.first->close_pipe(endpoint.second);
    return;
  }
  pipe.index = result->to<std::int32_t>().value();
  pipe.state = AttachState::attached;
  const auto endpoints = pipe.endpoints;
  for (const auto& endpoint : endpoints)
    if (endpoints_.contains(endpoint)) endpoint.first->accept_pipe(endpoint.second);
  pace_pipe(number);
}

void Upstream::leave_pipe(UpstreamClient& client, rr::PipeId id) {
  const EndpointKey endpoint(&client, id);
  const auto known = endpoints_.find(endpoint);
  if (known == endpoints_.end()) return;
  const auto number = known->second;
  const auto found = pipes_.find(number);
  end_endpoint(endpoint);
  auto& pipe = found->second;
  std::erase(pipe.endpoints, endpoint);
  if (!pipe.endpoints.empty()) return pace_pipe(number);
  if (connection_ && pipe.state == AttachState::attached)
    connection_->disconnect_pipe(pipe.path, pipe.member.name, pipe.index, ignore_result);
  if (pipe.member.direction() == rr::MemberDirection::readonly) shared_pipes_.erase({pipe.path, pipe.member.name});
  pipes_.erase(found);
}

void Upstream::end_endpoint(const EndpointKey& endpoint) {
  endpoints_left_ += endpoints_.erase(endpoint);
}

void Upstream::drop_pipe(PipeNumber number) {
  const auto dropped = pipes_.extract(number);
  if (!dropped) return;
  const auto& pipe = dropped.mapped();
  if (const auto known = shared_pipes_.find({pipe.path, pipe.member.name});
      known != shared_pipes_.end() && known->second == number)
    shared_pipes_.erase(known);
  for (const auto& endpoint : pipe.endpoints) end_endpoint(endpoint);
  for (const auto& endpoint : pipe.endpoints)
    if (has(*endpoint.first)) endpoint.first->close_pipe(endpoint.second);
}

rr::Result<> Upstream::send_pipe(UpstreamClient& client, rr::PipeId id, const rr::Value& packet,
                                 std::optional<std::uint32_t> wants_ack) {
  const EndpointKey endpoint(&client, id);
  const auto is_closed = rr::make_error(rr::ErrorCode::invalid_operation, "the pipe is not connected");
  auto known = endpoints_.find(endpoint);
  if (known == endpoints_.end()) return is_closed;
  const auto& asked = pipes_.at(known->second);
  const auto allowed = locks_->check_packet(client, asked.path, asked.member);
  known = endpoints_.find(endpoint);  // a lease that has ended meanwhile had something sent: the session may be lost
  if (known == endpoints_.end()) return is_closed;
  auto& pipe = pipes_.at(known->second);
  auto sent = !allowed                                             ? allowed
              : pipe.state == AttachState::attached && connection_ ? pass_on(pipe, known->first, packet, wants_ack)
                                                                   : rr::Result<>(lost_error());
  if (sent) return {};
  log(LogLevel::info, "pipe endpoint closed: its packet was not taken",
      {{"device", device_->config().name},
       {"pipe", pipe.path + "." + pipe.member.name},
       {"error", sent.error().message}});
  end_pipe(client, id);
  return sent;
}

void Upstream::end_pipe(UpstreamClient& client, rr::PipeId id) {
  leave_pipe(client, id);
  client.close_pipe(id);
}

void Upstream::end_sent_pipes(UpstreamClient& client) {
  std::vector<rr::PipeId> sent;
  const EndpointKey first(&client, 0);
  for (auto it = endpoints_.lower_bound(first); it != endpoints_.end() && it->first.first == &client; ++it)
    if (pipes_.at(it->second).has_sent) sent.push_back(it->first.second);
  for (const auto id : sent)
    if (endpoints_.contains({&client, id})) end_pipe(client, id);
}

rr::Result<> Upstream::pass_on(Pipe& pipe, const EndpointKey& endpoint, const rr::Value& packet,
                               std::optional<std::uint32_t> wants_ack) {
  const auto connection = connection_;  // it may be lost
  pipe.has_sent = true;
  if (!wants_ack) return connection->send_pipe(pipe.path, pipe.member.name, pipe.index, packet);
  const auto known = endpoint;
  const auto sent = connection->send_pipe_for_ack(pipe.path, pipe.member.name, pipe.index, packet);
  if (!sent) return sent.error();
  const auto found = endpoints_.find(known);
  if (found == endpoints_.end()) return {};
  auto& waiting = pipes_.at(found->second).unacknowledged;
  waiting[*sent] = *wants_ack;
  if (connection_ && waiting.size() <= max_unacknowledged) return {};
  const std::uint32_t oldest = waiting.extract(waiting.begin()).mapped();
  known.first->acknowledge_packets(known.second, {&oldest, 1});
  return {};
}

/// Acknowledgements pass, so that a client has no more packets on the way than it wants, the device's among them.
void Upstream::pass_back_acks(PipeNumber number, std::span<const std::uint32_t> numbers) {
  const auto found = pipes_.find(number);
  if (found == pipes_.end() || found->second.endpoints.empty()) return;
  auto& pipe = found->second;
  std::vector<std::uint32_t> arrived;
  for (const auto each : numbers)
    if (const auto known = pipe.unacknowledged.extract(each)) arrived.push_back(known.mapped());
  const auto endpoint = pipe.endpoints.front();
  if (!arrived.empty()) endpoint.first->acknowledge_packets(endpoint.second, arrived);
}

std::vector<Upstream::PipeNumber> Upstream::pipes_of(const UpstreamClient& client) const {
  std::vector<PipeNumber> numbers;
  const EndpointKey first(const_cast<UpstreamClient*>(&client), 0);
  for (auto it = endpoints_.lower_bound(first); it != endpoints_.end() && it->first.first == &client; ++it)
    numbers.push_back(it->second);
  return numbers;
}

// --- credit ---

void Upstream::pace(UpstreamClient& client) {
  for (const auto number : pipes_of(client)) pace_pipe(number);
}

/// A device that bounds its packets on the way gives them out by their acknowledgements. Held back, they keep it from
/// sending what a slow client could only be cut for.
void Upstream::pace_pipe(PipeNumber number) {
  const auto found = pipes_.find(number);
  if (found == pipes_.end() || !connection_ || found->second.state != AttachState::attached) return;
  auto& pipe = found->second;
  const bool is_held = std::any_of(pipe.endpoints.begin(), pipe.endpoints.end(),
                                   [](const EndpointKey& endpoint) { return endpoint.first->is_behind(); });
  if (is_held == pipe.is_held) return;
  pipe.is_held = is_held;
  const auto connection = connection_;  // it may be lost
  connection->hold_pipe_acks(pipe.path, pipe.member.name, pipe.index, is_held);
}

}  // namespace rrgate
