#include "core/member/wire.hpp"

namespace rr {

Result<> write_wire_value(Message& message, const Value& value, TimeSpec time, const MemberDefinition& member,
                          const TypeRegistry& types) {
  message.begin_nested("packettime", DataType::structure_t, "RobotRaconteur.TimeSpec");
  message.add_scalar("seconds", DataType::int64_t, time.seconds);
  message.add_scalar("nanoseconds", DataType::int32_t, time.nanoseconds);
  message.end_nested();
  return pack(message, "packet", value, member.type, types);
}

Result<> write_wire_packet(Message& message, std::string_view path, const MemberDefinition& member, const Value& value,
                           TimeSpec time, const TypeRegistry& types) {
  message.header.metadata = unreliable_metadata;
  message.begin_entry(EntryType::wire_packet, path, member.name).metadata = unreliable_metadata;
  return write_wire_value(message, value, time, member, types);
}

void WirePacket::set_path(std::string_view path) {
  path_ = path;
  message_.forget_encoded();
  for (auto& entry : message_.message.entries) entry.service_path = path;
}

Result<SharedMessage*> WirePacket::message(const TypeRegistry& types) {
  return message_.pack(
      [&](Message& message) { return write_wire_packet(message, path_, member_, value_, time_, types); });
}

Result<WireValue> read_wire_value(const Message& message, const MessageEntry& entry, const MemberDefinition& member,
                                  const TypeRegistry& types) {
  const auto elements = message.elements_of(entry);
  const auto* packet_time = elements.find("packettime");
  const auto* packet = elements.find("packet");
  if (!packet_time || !packet)
    return make_error(ErrorCode::message_element_not_found,
                      "wire '" + member.name + "': element " + (packet ? "packettime" : "packet") + " not found");
  WireValue out;
  const auto parts = message.children_of(*packet_time);
  const auto* seconds = parts.find("seconds");
  const auto* nanoseconds = parts.find("nanoseconds");
  if (!seconds || seconds->type != DataType::int64_t || seconds->count == 0 || !nanoseconds ||
      nanoseconds->type != DataType::int32_t || nanoseconds->count == 0)
    return make_error(ErrorCode::data_type_mismatch,
                      "wire '" + member.name + "': packettime is not a RobotRaconteur.TimeSpec");
  out.time =
      TimeSpec{load<std::int64_t>(seconds->data.data()), load<std::int32_t>(nanoseconds->data.data())}.normalized();
  auto value = unpack(message, *packet, member.type, types);
  if (!value) return value.error();
  out.value = std::move(*value);
  return out;
}

bool WireConnection::accept(TimeSpec time) {
  if (last_received && time <= *last_received) return false;
  last_received = time;
  return true;
}

TimeSpec WireConnection::stamp(TimeSpec utc) {
  if (last_sent && utc <= *last_sent) utc = last_sent->plus_one_nanosecond();
  last_sent = utc;
  return utc;
}

}  // namespace rr
