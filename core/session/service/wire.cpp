// Wires of a service session. Layer: session. Source: sessions spec section 2.13.
#include <utility>

#include "core/member/error_entry.hpp"
#include "core/member/member_table.hpp"
#include "core/session/service/service_session.hpp"

namespace rr {

// --- asked ---

Result<> ServiceSession::send_wire(std::string_view path, const MemberDefinition& member, const Value& value, Now now) {
  WirePacket packet(path, member, value, now.utc, now.steady);
  return send_wire(packet, now);
}

Result<> ServiceSession::send_wire(WirePacket& packet, Now now, LentMessage* lent) {
  const auto found = wires_.find(PathMemberView{packet.path(), packet.member().name});
  if (!may_use_service() || found == wires_.end()) return {};
  auto& wire = found->second;
  if (wire.waiting) ++wire.ledger.conflated;
  wire.waiting.reset();
  if (wire.state == WireState::connected && connection_.queued_bytes() < wire_high_mark)
    return send_wire_packet(wire, packet, now, lent);
  wire.waiting = WireValue{packet.time(), packet.value()};
  wire.waiting_since = packet.arrived();
  return {};
}

Result<> ServiceSession::send_wire_packet(WireConnection& wire, WirePacket& packet, Now now, LentMessage* lent) {
  std::optional<WirePacket> own;  // where this client needs another stamp
  if (const auto time = wire.stamp(packet.time()); time != packet.time()) {
    own.emplace(packet.path(), packet.member(), packet.value(), time, packet.arrived());
    lent = nullptr;
  }
  const auto message = (own ? *own : packet).message(service_->types());
  if (!message) return message.error();
  auto sent = connection_.send(**message, now, false, lent);
  if (sent)
    wire.ledger.note_delivery(now.steady - packet.arrived());
  else if (connection_.state() == ConnectionState::closed)
    leave(sent.error(), now);  // with all wires
  return sent;
}

/// In turns: a wire that fills the stream again and again does not hold up those that sort behind it.
void ServiceSession::flush_wires(Now now) {
  if (!may_use_service()) return;
  auto next = wires_.upper_bound(last_flushed_);
  for (auto left = wires_.size(); left > 0; --left) {
    if (next == wires_.end()) next = wires_.begin();
    auto& [key, wire] = *next++;
    if (!wire.waiting || wire.state == WireState::connecting) continue;
    last_flushed_ = key;
    const auto [time, value] = *std::exchange(wire.waiting, std::nullopt);
    WirePacket packet(key.path, *wire.member, value, time, wire.waiting_since);
    // What can fail is a value that does not fit, which others don't wait for, or the session, with all its wires.
    (void)send_wire_packet(wire, packet, now, nullptr);
    if (!service_ || connection_.queued_bytes() >= wire_high_mark) return;
  }
}

void ServiceSession::note_conflated(std::string_view path, const MemberDefinition& member, std::uint64_t count) {
  const auto wire = wires_.find(PathMemberView{path, member.name});
  if (wire != wires_.end()) wire->second.ledger.conflated += count;
}

void ServiceSession::answer_wire(std::string_view path, const MemberDefinition& member, const Result<>& result,
                                 Now now) {
  const auto wire = wires_.find(PathMemberView{path, member.name});
  if (wire == wires_.end() || wire->second.state == WireState::connected) return;
  const auto request_id = wire->second.request_id;
  wire->second.state = WireState::connected;
  if (!result) end_wire(wire);
  connection_.begin_message(outgoing_);
  outgoing_.begin_entry(EntryType::wire_connect_ret, path, member.name, request_id);
  if (!result) write_own_error(result.error());
  send_outgoing(now);
  flush_wires(now);
}

void ServiceSession::close_wire(std::string_view path, const MemberDefinition& member, Now now) {
  const auto wire = wires_.find(PathMemberView{path, member.name});
  if (wire == wires_.end()) return;
  if (wire->second.state == WireState::connecting)
    return answer_wire(path, member, make_error(ErrorCode::service_error, "the wire was closed"), now);
  end_wire(wire);
  connection_.begin_message(outgoing_);
  outgoing_.header.metadata = unreliable_metadata;
  outgoing_.begin_entry(EntryType::wire_closed, path, member.name);
  send_outgoing(now);
}

bool ServiceSession::has_wire(std::string_view path, std::string_view member) const {
  return wires_.find(PathMemberView{path, member}) != wires_.end();
}

Ledgers ServiceSession::total_ledgers() const {
  auto total = ended_ ? *ended_ : Ledgers();
  for (const auto& [key, wire] : wires_) total.wires.add(wire.ledger);
  for (const auto& [id, pipe] : pipes_) total.pipes.add(pipe.ledger);
  return total;
}

// --- received ---

Result<> ServiceSession::answer_wire(const MessageEntry& entry, const HostedService::Found& found,
                                     const MemberDefinition& member, Now now) {
  PathMember key{std::string(entry.service_path), std::string(entry.member_name)};
  if (entry.type == EntryType::wire_disconnect_req) {
    const auto wire = wires_.find(key);
    if (wire == wires_.end()) return make_error(ErrorCode::service_error, "Invalid wire connection");
    if (wire->second.state == WireState::connecting)
      answer_wire(key.path, member, make_error(ErrorCode::operation_aborted, "the wire was disconnected"), now);
    else
      end_wire(wire);
    if (!service_) return {};  // the answer could not be sent
    events_.push(WireDisconnected{key.path, &member});
    begin_reply(entry);
    send_outgoing(now);
    return {};
  }
  if (wires_.size() >= options_.max_wires && !wires_.contains(key))
    return make_error(ErrorCode::out_of_system_resource,
                      "this client has " + std::to_string(options_.max_wires) + " wires connected already");
  // A second request of a connected client is accepted: it is the same connection. One of a client that still waits is
  // answered in place of the first.
  const bool is_remote = service_->is_remote();
  WireConnection fresh{is_remote ? WireState::connecting : WireState::connected, &member, entry.request_id};
  fresh.object_use = service_->use_object(key.path);
  const auto [wire, is_new] = wires_.try_emplace(key, fresh);
  if (is_new && is_remote) {
    events_.push(WireConnected{key.path, found.object, &member});
    return {};
  }
  if (!is_new && wire->second.state == WireState::connecting) {
    connection_.begin_message(outgoing_);
    outgoing_.begin_entry(EntryType::wire_connect_ret, key.path, member.name,
                          std::exchange(wire->second.request_id, entry.request_id));
    write_error(outgoing_, make_error(ErrorCode::operation_aborted, "the wire was asked for anew"));
    send_outgoing(now);
    return {};
  }
  begin_reply(entry);
  send_outgoing(now);
  if (is_new && service_) events_.push(WireConnected{key.path, found.object, &member});
  return {};
}

void ServiceSession::handle_wire_packet(const Message& message, const MessageEntry& entry) {
  const auto wire = wires_.find(PathMemberView{entry.service_path, entry.member_name});
  if (wire == wires_.end() || !check_direction(entry.type, *wire->second.member)) return;
  if (!admit(entry.type, entry.service_path, wire->second.member)) return;
  const auto* member = wire->second.member;
  auto packet = read_wire_value(message, entry, *member, service_->types());
  if (!packet || !wire->second.accept(packet->time)) return;
  const auto service = service_;
  auto found = service->find_object(entry.service_path);
  if (!found || !has_wire(entry.service_path, member->name)) return;  // the application, which was asked, may close it
  events_.push(WireReceived{std::move(found->object), member, packet->time, std::move(packet->value)});
}

// --- ended ---

ServiceSession::Wires::iterator ServiceSession::end_wire(Wires::iterator wire) {
  ended().wires.add(wire->second.ledger);
  if (wire->second.state == WireState::connecting) release_pass(wire->second.request_id);
  return wires_.erase(wire);
}

/// Those that wait for an answer get `why`; the others' clients know by other means.
void ServiceSession::release_wires(std::string_view path, const Error& why, Now now) {
  for (auto wire = wires_.begin(); wire != wires_.end();) {
    if (!is_within(wire->first.path, path)) {
      ++wire;
    } else if (wire->second.state == WireState::connecting) {
      const auto key = wire->first;
      answer_wire(key.path, *wire->second.member, why, now);
      wire = wires_.upper_bound(key);  // what could not be sent has ended the session, and all that it had
    } else {
      wire = end_wire(wire);
    }
  }
}

void ServiceSession::end_all_wires() {
  while (!wires_.empty()) end_wire(wires_.begin());
}

}  // namespace rr
