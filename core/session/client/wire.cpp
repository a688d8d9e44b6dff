// Wires of a client session. Layer: session. Source: sessions spec section 2.12.
#include <functional>
#include <utility>

#include "core/member/member_table.hpp"
#include "core/session/client/client_session.hpp"

namespace rr {

// --- asked ---

RequestId ClientSession::request_wire(EntryType type, std::string_view path, std::string_view member, Now now,
                                      const Value* value) {
  const auto write = [&](const MemberDefinition& definition) -> Result<> {
    if (!value) return {};
    return write_wire_value(outgoing_, *value, now.utc, definition, types_);
  };
  return request_elements(type, MemberKind::wire, path, member, now, std::ref(write));
}

RequestId ClientSession::connect_wire(std::string_view path, std::string_view member, Now now) {
  const auto id = request_wire(EntryType::wire_connect_req, path, member, now);
  if (const auto found = pending_.find(id); found != pending_.end())
    wires_[{std::string(path), std::string(member)}] = {.member = found->second.member, .request_id = id};
  return id;
}

RequestId ClientSession::disconnect_wire(std::string_view path, std::string_view member, Now now) {
  if (const auto found = wires_.find(PathMemberView{path, member}); found != wires_.end()) {
    send_waiting_value(found->first, found->second, now);
    wires_.erase(found);
  }
  return request_wire(EntryType::wire_disconnect_req, path, member, now);
}

RequestId ClientSession::peek_in_value(std::string_view path, std::string_view member, Now now) {
  return request_wire(EntryType::wire_peek_in_value_req, path, member, now);
}

RequestId ClientSession::peek_out_value(std::string_view path, std::string_view member, Now now) {
  return request_wire(EntryType::wire_peek_out_value_req, path, member, now);
}

RequestId ClientSession::poke_out_value(std::string_view path, std::string_view member, const Value& value, Now now) {
  const auto id = request_wire(EntryType::wire_poke_out_value_req, path, member, now, &value);
  if (pending_.contains(id)) drop_waiting_value(path, member);  // it is older, and would be sent behind this one
  return id;
}

Result<> ClientSession::send_wire(std::string_view path, std::string_view member, const Value& value, Now now) {
  const auto found = wires_.find(PathMemberView{path, member});
  if (state_ == ClientState::closed || found == wires_.end() || found->second.state != WireState::connected)
    return make_error(ErrorCode::invalid_operation, "wire " + quote(member) + " is not connected");
  if (auto allowed = check_direction(EntryType::wire_packet, *found->second.member); !allowed) return allowed;
  if (connection_.queued_bytes() >= wire_high_mark) {
    found->second.waiting = WireValue{now.utc, value};
    return {};
  }
  return send_wire_packet(found->first, found->second, value, now);
}

void ClientSession::drop_waiting_value(std::string_view path, std::string_view member) {
  if (const auto found = wires_.find(PathMemberView{path, member}); found != wires_.end())
    found->second.waiting.reset();
}

Result<> ClientSession::send_wire_packet(const PathMember& key, WireConnection& wire, const Value& value, Now now) {
  wire.waiting.reset();
  connection_.begin_message(outgoing_);
  if (auto written = write_wire_packet(outgoing_, key.path, *wire.member, value, wire.stamp(now.utc), types_); !written)
    return written;
  return send_outgoing(now);
}

void ClientSession::send_waiting_value(const PathMember& key, WireConnection& wire, Now now) {
  if (!wire.waiting || state_ == ClientState::closed) return;
  const Value value = std::move(wire.waiting->value);
  // What can fail is a value that does not fit, which others don't wait for, or the connection, which is heard
  // elsewhere.
  (void)send_wire_packet(key, wire, value, now);
}

/// In turns: a wire that fills the stream again and again does not hold up those that sort behind it.
void ClientSession::flush_wires(Now now) {
  auto next = wires_.upper_bound(last_flushed_);
  for (auto left = wires_.size(); left > 0; --left) {
    if (next == wires_.end()) next = wires_.begin();
    auto& [key, wire] = *next++;
    if (!wire.waiting) continue;
    last_flushed_ = key;
    send_waiting_value(key, wire, now);
    if (connection_.queued_bytes() >= wire_high_mark) return;
  }
}

// --- received ---

/// The wire that a connect reply is for; none where it was disconnected meanwhile, be it connected anew.
ClientSession::Wires::iterator ClientSession::find_connecting_wire(const Pending& pending, RequestId id) {
  const auto found = wires_.find(PathMemberView{pending.path, pending.member->name});
  return found != wires_.end() && found->second.request_id == id ? found : wires_.end();
}

void ClientSession::handle_wire_connected(const Pending& pending, RequestId id) {
  const auto found = find_connecting_wire(pending, id);
  if (found == wires_.end()) return;
  auto& wire = found->second;
  wire.state = WireState::connected;
  if (!wire.early) return;
  emit(WireValueReceived{found->first.path, found->first.member, wire.early->time, std::move(wire.early->value)});
  wire.early.reset();
}

/// What came too late is ended: nobody wants it. Not a wire that was connected anew, which is the same connection, nor
/// a lock that was asked for anew.
void ClientSession::end_late(const Message& message, const MessageEntry& entry, const Pending& pending, Now now) {
  if (entry.error != ErrorCode::none) return;
  const auto* member = pending.member;
  if (pending.type == EntryType::wire_connect_req) {
    if (wires_.contains(PathMemberView{pending.path, member->name})) return;
    begin_request(EntryType::wire_disconnect_req, pending.path, member->name);
  } else if (member) {
    const auto index = read_generator_index(message, entry, *member);
    if (!index) return;
    begin_request(EntryType::generator_next_req, pending.path, member->name);
    (void)write_generator_step(outgoing_, GeneratorStep::close, *index, {}, *member, types_);  // nothing that can fail
  } else {
    const bool is_monitor = entry.member_name.ends_with("Enter");  // also where the service has it wait
    if (!is_monitor && !entry.member_name.starts_with("Request")) return;
    for (const auto& [id, other] : pending_)
      if (other.type == pending.type && !other.is_abandoned && other.path == pending.path) return;
    begin_request(pending.type, pending.path, is_monitor ? "MonitorExit" : "ReleaseObjectLock");
  }
  send_outgoing(now);  // its reply is nobody's
}

void ClientSession::handle_wire_packet(const Message& message, const MessageEntry& entry) {
  const auto found = wires_.find(PathMemberView{entry.service_path, entry.member_name});
  if (found == wires_.end() || found->second.member->direction() == MemberDirection::writeonly) return;
  auto& wire = found->second;
  auto packet = read_wire_value(message, entry, *wire.member, types_);
  if (!packet) return;
  if (wire.state == WireState::connecting) {
    // It may be of the connection before, whose time stamps say nothing of this one's: a clock may have been set back.
    wire.early = std::move(*packet);
    return;
  }
  if (!wire.accept(packet->time)) return;
  emit(WireValueReceived{found->first.path, found->first.member, packet->time, std::move(packet->value)});
}

void ClientSession::handle_wire_closed(const MessageEntry& entry) {
  const auto found = wires_.find(PathMemberView{entry.service_path, entry.member_name});
  // While a connect is not answered, it is the connection before that has ended.
  if (found == wires_.end() || found->second.state == WireState::connecting) return;
  emit(WireClosedByService{found->first.path, found->first.member});
  wires_.erase(found);
}

void ClientSession::release_wires(std::string_view path) {
  for (auto wire = wires_.begin(); wire != wires_.end();) {
    const auto released = wire++;
    const auto& key = released->first;
    if (!is_within(key.path, path)) continue;
    if (released->second.state == WireState::connecting) {
      const auto id = released->second.request_id;
      Completed failed{id, object_replaced(key.path)};
      cancel(id);  // with the wire
      emit(std::move(failed));
    } else {
      emit(WireClosedByService{key.path, key.member});
      wires_.erase(released);
    }
  }
}

}  // namespace rr
