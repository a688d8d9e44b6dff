// Messages of pipes, written by hand.
#pragma once

#include "test/core/session/loopback.hpp"

namespace rr::test {

/// A message as the other side would send it; `write` fills in its entries.
inline Bytes encode_from(const Connection& receiver, const std::function<void(Message&)>& write) {
  Message message;
  message.header.version = 4;
  message.header.sender_node_id = receiver.peer().id;
  message.header.receiver_node_id = receiver.self().id;
  message.header.sender_endpoint = receiver.remote_endpoint();
  message.header.receiver_endpoint = receiver.local_endpoint();
  write(message);
  EncodedMessage encoded;
  encode(message, {}, encoded).value();
  Bytes bytes;
  for (const auto slice : encoded.slices()) bytes.insert(bytes.end(), slice.begin(), slice.end());
  return bytes;
}

/// Adds one packet of `samples` (or a pipe of the same type), whose value the message keeps.
inline void add_packet(Message& message, std::int32_t index, std::uint32_t number, double value,
                       bool wants_ack = false) {
  static const MemberDefinition samples{MemberKind::pipe, "samples", TypeDefinition{.type = DataType::double_t}};
  const auto kept = std::make_shared<const Value>(value);
  message.keep_alive(kept);
  write_pipe_packet(message, index, number, *kept, wants_ack, samples, {}).value();
}

}  // namespace rr::test
