// One stream to a peer: framing, CreateConnection, heartbeats, limits. Layer: session.
// Source: transports spec sections 2 and 3; sessions spec section 2.2.
//
// The sans-IO contract of every class in this layer that owns a Connection:
//   told        handle_bytes(span, now) (returns what it took; the rest comes again when it is asked for),
//   handle_timeout(now), handle_closed(error, now) asked       call..., close(...) answers     poll_transmit(),
//   poll_timeout(), poll_event(): poll in this order after everything told or asked looked at   state and counters
// Nothing in here knows sockets, threads or clocks: time is a parameter, completion is an event.
#pragma once

#include <chrono>
#include <cstdint>
#include <optional>
#include <string>

#include "core/session/capabilities.hpp"
#include "core/session/transmit_queue.hpp"
#include "core/support/time.hpp"
#include "core/wire/frame_scanner.hpp"

namespace rr {

struct NodeIdentity {
  NodeId id;         ///< any: not known, or "whoever answers"
  std::string name;  ///< may be empty
  bool operator==(const NodeIdentity&) const = default;
};

enum class ConnectionRole : std::uint8_t { client, service };
enum class ConnectionState : std::uint8_t {
  handshaking,  ///< client: CreateConnection is not answered yet; service: nothing received yet
  open,
  closed,
};

struct ConnectionOptions {
  NodeIdentity self;
  NodeIdentity target = {};  ///< client: the node that the URL asks for
  /// What the peer is known to be by TLS, and so must say in every message. Any: nothing is known.
  NodeId known_peer = {};
  bool is_encrypted = false;  ///< the stream is TLS already: a service refuses to start it again
  Features features = {};
  std::size_t max_message_size = 12u * 1024 * 1024;
  std::size_t max_queued_bytes = 64u * 1024 * 1024;    ///< a peer that reads slower than that is closed
  std::chrono::milliseconds heartbeat_period{10'000};  ///< without sending or receiving anything
  std::chrono::milliseconds receive_timeout{15'000};   ///< after an unanswered heartbeat
  std::chrono::milliseconds handshake_timeout{5'000};
};

struct ConnectionStats {
  std::uint64_t messages_received = 0;
  std::uint64_t messages_sent = 0;
  std::uint64_t bytes_received = 0;
  std::uint64_t bytes_sent = 0;
};

/// What was sent without being copied: the bytes are those that the next receiver is sent, too.
struct LentMessage {
  SharedMessage* message = nullptr;  ///< null: nothing was lent
  std::span<const ByteSpan> slices = {};
  std::size_t size = 0;  ///< of the slices together
};

/// The stream layer of a connection, for both roles. Its owner feeds bytes with receive(), looks at message() after
/// each call, and sends with send().
class Connection {
 public:
  Connection(ConnectionRole role, ConnectionOptions options, Now now);

  // --- told ---

  /// `input`  borrowed until the next call; any length.
  /// Returns  bytes consumed; stops behind the first message that is for the session, which message() then holds.
  ///          Stream operations and heartbeats are answered in here.
  /// Errors   whatever closes the connection: it is closed when this fails.
  Result<std::size_t> receive(ByteSpan input, Now now);
  /// The message that the last receive() stopped at, with all header fields filled in; nullptr if there is none.
  const Message* message() const { return has_message_ ? &incoming_ : nullptr; }
  /// The message is dealt with: gives the memory of a large one back.
  void release_message();
  /// Sends a due heartbeat, or fails with the reason for which the connection is now closed.
  Result<> handle_timeout(Now now);
  /// What the peer sends is not read for the moment: it can't be blamed for its silence.
  void excuse_silence(Now now);
  /// The bytes of poll_transmit() that were written.
  void handle_transmitted(std::size_t bytes, Now now);
  /// Of what the last send() has lent `bytes` were written; the rest is queued. Returns whether there is none.
  bool handle_lent(const LentMessage& lent, std::size_t bytes, Now now);

  // --- asked ---

  /// Fills in version, node ids, names and elision, encodes and queues. Endpoints and message id are the caller's
  /// (begin_message() sets them). Entry types below 500 keep full routing. What was sent is empty afterwards.
  /// Errors   connection_error when closed or the queue is full; protocol_error above the size limit.
  Result<> send(Message& message, Now now, bool is_urgent = false);
  /// Sends what other peers are sent as well, addressed to this one's session. `lent`: where nothing waits for the
  /// stream the message is not queued, but is to be written from there, at once. Errors   those of send().
  Result<> send(SharedMessage& message, Now now, bool is_urgent = false, LentMessage* lent = nullptr);
  /// Clears `message` and addresses it to the peer's session: endpoints and the next message id.
  void begin_message(Message& message);
  /// The size limit rises from 512 KiB to max_message_size.
  void authorise();
  void set_endpoints(std::uint32_t local, std::uint32_t remote);
  void close(Error reason);

  // --- answers ---

  std::span<const ByteSpan> poll_transmit() { return queue_.slices(); }
  TimePoint poll_timeout() const;

  // --- looked at ---

  ConnectionState state() const { return state_; }
  /// Why it was closed; meaningful in state closed.
  const Error& close_reason() const { return close_reason_; }
  const Features& features() const { return agreed_; }
  const NodeIdentity& self() const { return options_.self; }
  const NodeIdentity& peer() const { return peer_; }
  std::uint32_t local_endpoint() const { return local_endpoint_; }
  std::uint32_t remote_endpoint() const { return remote_endpoint_; }
  /// Of memory, which is more than the bytes of the messages.
  std::size_t queued_bytes() const { return queue_.held(); }
  /// What waits for the stream, and what has come of a message that is not complete.
  std::size_t held_bytes() const { return queue_.held() + scanner_.held_bytes(); }
  /// Whether a peer that is not authorised leaves answers unread: it is to get no others before it has read those.
  bool is_held_back() const { return !is_authorised_ && queue_.held() > max_unauthorised_queued_bytes; }
  const ConnectionStats& stats() const { return stats_; }

 private:
  static constexpr std::size_t max_unauthorised_message_size = 512u * 1024;  ///< in force until authorise()
  static constexpr std::size_t max_unauthorised_queued_bytes = 64u * 1024;   ///< waiting for the stream

  Result<> handle_message(ByteSpan bytes, Now now);
  void fill_header();
  Result<> check_sender() const;
  Result<bool> handle_stream_entry(Now now);
  Result<> answer_stream_op(const MessageEntry& entry, Now now);
  Result<> answer_create_connection(const MessageEntry& entry, Now now);
  Result<> handle_stream_op_reply(const MessageEntry& entry);
  Result<> answer_capability(const MessageEntry& entry, Now now);
  Result<> answer_heartbeat(const MessageEntry& entry, Now now);
  Message begin_stream_reply(const MessageEntry& request) const;
  Result<> send_create_connection(Now now);
  Result<> send_heartbeat(Now now);
  void address(MessageHeader& header);
  void complete_header(Message& message) const;
  std::size_t message_limit() const {
    return is_authorised_ ? options_.max_message_size : max_unauthorised_message_size;
  }
  EncodeOptions encode_options() const;
  Result<> note_sent(Now now);
  bool is_for_us() const;
  Error closed_by(Error reason);

  ConnectionRole role_;
  ConnectionOptions options_;
  ConnectionState state_ = ConnectionState::handshaking;
  Error close_reason_{ErrorCode::connection_error, "connection closed"};
  Features agreed_ = legacy_features;
  NodeIdentity peer_;
  std::uint32_t local_endpoint_ = 0;
  std::uint32_t remote_endpoint_ = 0;
  std::uint16_t next_message_id_ = 0;
  bool is_authorised_ = false;

  FrameScanner scanner_;
  TransmitQueue queue_;
  Message incoming_;
  bool has_message_ = false;

  TimePoint opened_;
  TimePoint last_sent_;
  TimePoint last_received_;
  std::optional<TimePoint> heartbeat_sent_;  ///< not answered yet; begins anew while it waits for the stream
  std::size_t ahead_of_heartbeat_ = 0;       ///< bytes that the stream takes up to the end of it, at most
  ConnectionStats stats_;
};

}  // namespace rr
