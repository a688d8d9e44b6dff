// Wire: the newest value wins, in both directions. Layer: member. Source: sessions spec section 2.12.
#pragma once

#include <optional>

#include "core/member/ledger.hpp"
#include "core/support/time.hpp"
#include "core/types/pack.hpp"
#include "core/wire/shared_message.hpp"

namespace rr {

/// The token that marks messages and entries of wire packets.
inline constexpr std::string_view unreliable_metadata = "unreliable\n";

/// Above this many bytes waiting for the stream, wire values are replaced instead of queued.
inline constexpr std::size_t wire_high_mark = 64 * 1024;

/// Adds `packettime` and `packet` to the last entry.
Result<> write_wire_value(Message& message, const Value& value, TimeSpec time, const MemberDefinition& member,
                          const TypeRegistry& types);
/// Makes an empty message a wire packet. What cannot be packed leaves it half written.
Result<> write_wire_packet(Message& message, std::string_view path, const MemberDefinition& member, const Value& value,
                           TimeSpec time, const TypeRegistry& types);

struct WireValue {
  TimeSpec time;
  Value value;
};

/// A value on its way to all who have connected a wire; packed and encoded once for them.
class WirePacket {
 public:
  /// `path`, `member` and `value` are borrowed. `arrived` is when the value came here.
  WirePacket(std::string_view path, const MemberDefinition& member, const Value& value, TimeSpec time,
             TimePoint arrived)
      : path_(path), member_(member), value_(value), time_(time), arrived_(arrived) {}

  std::string_view path() const { return path_; }
  /// The same value by another path of its object.
  void set_path(std::string_view path);
  const MemberDefinition& member() const { return member_; }
  const Value& value() const { return value_; }
  TimeSpec time() const { return time_; }
  TimePoint arrived() const { return arrived_; }
  /// Packed by the first call. Errors   those of pack().
  Result<SharedMessage*> message(const TypeRegistry& types);

 private:
  std::string_view path_;
  const MemberDefinition& member_;
  const Value& value_;
  TimeSpec time_;
  TimePoint arrived_;
  SharedMessage message_;
};

/// Reads `packettime` and `packet`.
Result<WireValue> read_wire_value(const Message& message, const MessageEntry& entry, const MemberDefinition& member,
                                  const TypeRegistry& types);

enum class WireState : std::uint8_t { connecting, connected };

/// One side of one wire connection. State starts afresh with each connect.
struct WireConnection {
  WireState state = WireState::connecting;
  const MemberDefinition* member = nullptr;
  std::uint32_t request_id = 0;  ///< of the connect: a client's, and a service's that answers it later
  std::optional<TimeSpec> last_received = {};
  std::optional<TimeSpec> last_sent = {};
  std::optional<WireValue> early = {};    ///< came before the connect reply; newest only
  std::optional<WireValue> waiting = {};  ///< to be sent when the stream has room; newest only
  TimePoint waiting_since = {};           ///< when that came here
  Ledger ledger = {};
  std::shared_ptr<const void> object_use = {};  ///< a service's: its object is remembered as long as this is connected

  /// Whether a packet of this time is newer than all before; remembers it.
  bool accept(TimeSpec time);
  /// The stamp for a value sent now: the clock, but strictly later than the stamp before.
  TimeSpec stamp(TimeSpec utc);
};

}  // namespace rr
