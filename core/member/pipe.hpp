// Pipe: numbered packets between two endpoints, in order, none lost. Layer: member. Source: sessions spec section 2.11.
#pragma once

#include <map>
#include <span>
#include <string>
#include <string_view>

#include "core/types/pack.hpp"
#include "core/wire/shared_message.hpp"

namespace rr {

/// What a client asks for when any index will do.
inline constexpr std::int32_t any_pipe_index = -1;

/// Begins the entry of packets in an empty message.
void begin_pipe_packets(Message& message, std::string_view path, std::string_view member, bool is_unreliable);
/// Adds one packet for the endpoint `index` to the last entry. Several endpoints may share an entry.
Result<> write_pipe_packet(Message& message, std::int32_t index, std::uint32_t number, const Value& value,
                           bool wants_ack, const MemberDefinition& member, const TypeRegistry& types);

/// A value on its way to many endpoints of a pipe; packed and encoded once for those in a row that differ in nothing
/// but the packet's number.
class SharedPipePacket {
 public:
  /// `value` is borrowed.
  explicit SharedPipePacket(const Value& value, bool wants_ack = false) : value_(value), wants_ack_(wants_ack) {}
  SharedPipePacket(const SharedPipePacket&) = delete;
  SharedPipePacket& operator=(const SharedPipePacket&) = delete;

  const Value& value() const { return value_; }
  /// The packet for one endpoint, until the next call. `path` and `member` are borrowed as long. Errors   those of
  /// pack().
  Result<SharedMessage*> message(std::string_view path, const MemberDefinition& member, bool is_unreliable,
                                 std::int32_t index, std::uint32_t number, const TypeRegistry& types);

 private:
  const Value& value_;
  bool wants_ack_;
  std::uint32_t number_ = 0;
  // whom message_ is for
  std::string path_;
  bool is_unreliable_ = false;
  std::int32_t index_ = 0;
  SharedMessage message_;
};

struct PipePacket {
  std::uint32_t number = 0;
  bool wants_ack = false;
  Value value;
  std::size_t size_bytes = 0;  ///< about what it takes in memory
};

/// The endpoint that an element of a packet or acknowledgement entry is for: its number, or its decimal name.
/// Errors   protocol_error: neither.
Result<std::int32_t> read_pipe_index(const MessageElement& element);
/// `packetnumber` and `requestack` of one packet; its value is left alone.
/// Errors   data_type_mismatch, message_element_not_found.
Result<PipePacket> read_pipe_packet_head(const Message& message, const MessageElement& element,
                                         const MemberDefinition& member);
/// Adds the value to what read_pipe_packet_head() gave. Errors: those of unpack().
Result<> read_pipe_packet_value(const Message& message, const MessageElement& element, const MemberDefinition& member,
                                const TypeRegistry& types, PipePacket& packet);

/// Acknowledges one packet of the endpoint `index` in the last entry.
void write_pipe_ack(Message& message, std::int32_t index, std::uint32_t number);
/// The numbers of one acknowledgement element. Errors: data_type_mismatch.
Result<std::vector<std::uint32_t>> read_pipe_ack(const MessageElement& element);

/// Adds / reads the element `index` of connect, disconnect and close.
void write_pipe_index(Message& message, std::int32_t index);
Result<std::int32_t> read_pipe_index_element(const Message& message, const MessageEntry& entry,
                                             const MemberDefinition& member);
/// Adds `unreliable`: the wish in a connect request, the grant in its reply.
void write_unreliable(Message& message);
bool reads_unreliable(const Message& message, const MessageEntry& entry);

/// The room for packets that wait for an earlier one, for all endpoints of a session together.
struct PipeStore {
  std::size_t max_bytes = 16u * 1024 * 1024;
  std::size_t max_packets_ahead = 4096;  ///< for each endpoint: how far behind a missing packet
  std::size_t bytes = 0;                 ///< in use
};

enum class PipeState : std::uint8_t {
  connecting,  ///< not agreed on yet; what arrives is kept
  open,
  closing,  ///< the other side has not confirmed yet; what arrives is dropped
};

/// One side of one pipe endpoint: the numbers of both directions, and the packets that came too early.
class PipeEndpointState {
 public:
  /// `member` and `store` outlive it.
  PipeEndpointState(const MemberDefinition& member, PipeStore& store, PipeState state)
      : member_(&member), store_(&store), state_(state) {}
  PipeEndpointState(const PipeEndpointState&) = delete;
  PipeEndpointState& operator=(const PipeEndpointState&) = delete;
  ~PipeEndpointState();

  const MemberDefinition& member() const { return *member_; }
  PipeState state() const { return state_; }
  /// Whether packets are delivered as they come, whatever their number.
  bool is_unreliable() const { return is_unreliable_; }

  /// The number of the next packet to send; the first is 1.
  std::uint32_t take_number() { return next_sent_++; }
  /// Takes the number back: the packet could not be sent after all.
  void return_number() { --next_sent_; }

  /// What was agreed on. Calls `deliver(PipePacket&&)` for each packet that waited and is due.
  template <class Deliver>
  void open(bool is_unreliable, Deliver&& deliver);
  void start_closing() { state_ = PipeState::closing; }

  /// Calls `deliver(PipePacket&&)` for this packet and all that waited for it; keeps it where an earlier one is
  /// missing; drops it where it came before. Errors   out_of_system_resource: too many packets wait. The endpoint has
  /// to be closed: it can never go on.
  template <class Deliver>
  Result<> receive(PipePacket packet, Deliver&& deliver);

 private:
  Result<> keep(PipePacket packet);
  template <class Deliver>
  void deliver_waiting(Deliver&& deliver);
  PipePacket take_first();

  const MemberDefinition* member_;
  PipeStore* store_;
  PipeState state_;
  bool is_unreliable_ = false;
  std::uint32_t next_sent_ = 1;
  std::uint64_t received_ = 0;                   ///< in order; its lower half is the last number
  std::map<std::uint64_t, PipePacket> waiting_;  ///< by how many come up to and with it: order survives 2^32
};

template <class Deliver>
void PipeEndpointState::open(bool is_unreliable, Deliver&& deliver) {
  state_ = PipeState::open;
  is_unreliable_ = is_unreliable;
  deliver_waiting(deliver);
}

template <class Deliver>
Result<> PipeEndpointState::receive(PipePacket packet, Deliver&& deliver) {
  if (state_ == PipeState::closing) return {};
  if (state_ == PipeState::open && is_unreliable_) {
    deliver(std::move(packet));
    return {};
  }
  if (state_ == PipeState::connecting || packet.number != static_cast<std::uint32_t>(received_ + 1))
    return keep(std::move(packet));
  ++received_;
  deliver(std::move(packet));
  if (!waiting_.empty()) deliver_waiting(deliver);
  return {};
}

template <class Deliver>
void PipeEndpointState::deliver_waiting(Deliver&& deliver) {
  while (!waiting_.empty() && (is_unreliable_ || waiting_.begin()->first == received_ + 1)) {
    ++received_;
    deliver(take_first());
  }
}

}  // namespace rr
