// The pipes of a service's objects: handlers, endpoints, broadcasts. Layer: node/service.
#include <algorithm>

#include "node/service/refusal.hpp"
#include "node/service/service.hpp"

namespace rr {

void Object::set_pipe_handler(std::string_view name, std::shared_ptr<const OnEndpoint> Member::*slot,
                              OnEndpoint handler) {
  auto& mine = members_[&require_member(name, MemberKind::pipe)].*slot;
  mine = handler ? std::make_shared<const OnEndpoint>(std::move(handler)) : nullptr;
}

void Object::set_packet_handler(std::string_view name, HandlerType packet, PacketHandler handler) {
  const MemberDefinition& member = require_member(name, MemberKind::pipe);
  const std::string where = type_name() + "." + member.name;
  if (member.direction() == MemberDirection::readonly) refuse(where + " is readonly: clients send nothing on it");
  if (!accepts(packet, member.type))
    refuse(where + ": packets are " + format_type(member.type) + ", the handler takes " + handler_type_text(packet));
  members_[&member].pipe_received = std::make_shared<const PacketHandler>(std::move(handler));
}

std::size_t Object::broadcast(std::string_view pipe, const Value& value, std::int32_t max_backlog) {
  const MemberDefinition& member = require_member(pipe, MemberKind::pipe);
  if (member.direction() == MemberDirection::writeonly)
    refuse(type_name() + "." + member.name + " is writeonly: the service sends nothing on it");
  check_value(type_name() + "." + member.name, value, member.type, *service_.types_);
  const auto found = members_.find(&member);
  if (found == members_.end()) return 0;
  // Endpoints that are lost while they are sent to leave the list meanwhile.
  const auto endpoints = found->second.endpoints;
  SharedPipePacket packet(value, max_backlog != no_backlog_limit);
  return static_cast<std::size_t>(std::count_if(endpoints.begin(), endpoints.end(), [&](const PipeEndpoint& endpoint) {
    return endpoint.broadcast(packet, max_backlog);
  }));
}

std::vector<PipeEndpoint> Object::endpoints(std::string_view pipe) {
  return members_[&require_member(pipe, MemberKind::pipe)].endpoints;
}

// --- what clients do ---

void Object::connect_pipe(const MemberDefinition& pipe, const PipeEndpoint& endpoint) {
  Member& mine = members_[&pipe];
  if (const auto connected = mine.pipe_connected) (*connected)(endpoint);
  if (endpoint.is_open()) mine.endpoints.push_back(endpoint);
}

Result<> Object::receive_packet(const MemberDefinition& pipe, const PipeEndpoint& endpoint, const Value& packet) {
  const auto found = members_.find(&pipe);
  if (found == members_.end() || !found->second.pipe_received) return {};
  const auto received = found->second.pipe_received;
  return (*received)(endpoint, packet);
}

void Object::close_pipe(const MemberDefinition& pipe, const PipeEndpoint& endpoint, bool tells_handler) {
  Member& mine = members_[&pipe];
  const bool was_connected = std::erase(mine.endpoints, endpoint) > 0;
  if (!tells_handler || !was_connected) return;
  if (const auto closed = mine.pipe_closed) (*closed)(endpoint);
}

}  // namespace rr
