// The client's half of a session: one service over one connection. Layer: session.
// Source: sessions spec sections 2.3..2.9, 2.11..2.13. The sans-IO contract stands in connection.hpp.
#pragma once

#include <chrono>
#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "core/member/callback.hpp"
#include "core/member/generator.hpp"
#include "core/member/memory_transfer.hpp"
#include "core/member/pipe.hpp"
#include "core/member/wire.hpp"
#include "core/session/connection.hpp"
#include "core/session/known_definitions.hpp"
#include "core/session/protocol_level.hpp"
#include "core/session/service_path.hpp"
#include "core/support/fifo.hpp"
#include "core/support/spare_node.hpp"
#include "core/types/pack.hpp"
#include "core/types/read_definitions.hpp"

namespace rr {

struct ClientOptions {
  ConnectionOptions connection;
  std::string service;           ///< service name, e.g. "Create"
  std::string username = {};     ///< with credentials: logs in while connecting (see authenticate() for later)
  Value credentials = {};        ///< MapString, e.g. {"password": ...}; null for none
  std::string object_type = {};  ///< the type to use the root object as; empty: the service's own
  /// Those of an earlier session (see ClientSession::known_definitions()), or none yet; nullopt: the service is not
  /// asked for tags, and nothing is remembered.
  std::optional<std::vector<KnownDefinitions>> known_definitions = {};
  /// For sessions with many services that may have the same definitions; null: each session reads its own.
  std::shared_ptr<ReadDefinitions> read_definitions = {};
  std::chrono::milliseconds request_timeout{15'000};
  std::chrono::milliseconds connect_timeout{30'000};  ///< from construction to the event Connected
  std::uint32_t max_memory_transfer = 1024 * 1024;    ///< bytes; larger reads and writes of memories are split
  std::size_t max_events = 65'536;        ///< not polled; more close the session: nothing is dropped silently
  std::size_t max_open_callbacks = 1024;  ///< not answered yet; above: out_of_system_resource
  std::size_t max_pipe_queued_bytes = 32u * 1024 * 1024;  ///< waiting for the stream; above, pipes take no packets
  std::size_t max_held_acks = 4096;  ///< of one endpoint, see hold_pipe_acks(); above, the oldest is sent
};

using RequestId = std::uint32_t;

/// The session is up: root object and definitions are known.
struct Connected {
  std::string object_type;  ///< qualified type of the root object
};
/// A request ended. What the value is depends on the request (see ClientSession).
struct Completed {
  RequestId id = 0;
  Result<Value> result;
  bool is_unread = false;  ///< an error: the service has answered, and that can't be read
};
struct EventReceived {
  std::string path;
  std::string member;
  std::vector<Value> arguments;
};
/// A newer InValue of a connected wire.
struct WireValueReceived {
  std::string path;
  std::string member;
  TimeSpec time;
  Value value;
};
struct WireClosedByService {
  std::string path;
  std::string member;
};
struct PipePacketReceived {
  std::string path;
  std::string member;
  std::int32_t index = 0;
  Value value;
};
/// Packets that were sent with wants_ack have arrived.
struct PipePacketsAcknowledged {
  std::string path;
  std::string member;
  std::int32_t index = 0;
  std::vector<std::uint32_t> numbers;
};
/// The service closed the endpoint, or what it sent on it cannot be read.
struct PipeClosedByService {
  std::string path;
  std::string member;
  std::int32_t index = 0;
};
/// The service asks: to be answered exactly once, with reply_callback().
struct CallbackCalled {
  CallbackId id = 0;
  std::string path;
  std::string member;
  std::vector<Value> arguments;
};
/// The service replaced the object: every object at or below `path` must be looked up again.
struct PathReleased {
  std::string path;
};
/// The last event. Every pending request was completed with the reason before it.
struct SessionClosed {
  Error reason;
};
using ClientEvent =
    std::variant<Connected, Completed, EventReceived, WireValueReceived, WireClosedByService, PipePacketReceived,
                 PipePacketsAcknowledged, PipeClosedByService, CallbackCalled, PathReleased, SessionClosed>;

/// What an object lock keeps out: other users, or all other clients.
enum class LockKind : std::uint8_t { user, client };

/// The right to command an object, for so long as it is renewed. The numbers are those of the request.
enum class LeaseCommand : std::uint8_t { acquire, take_over, renew, release };
inline constexpr std::string_view lease_op = "rrgate.Lease";

enum class ClientState : std::uint8_t { connecting, connected, closing, closed };

/// One client session. Every request returns an id at once and ends in exactly one Completed event with that id, in
/// success and in failure; a request that cannot be sent fails the same way. Ids are never 0.
class ClientSession {
 public:
  ClientSession(ClientOptions options, Now now);
  ClientSession(const ClientSession&) = delete;
  ClientSession& operator=(const ClientSession&) = delete;

  // --- told ---

  /// Returns  bytes consumed: all.
  std::size_t handle_bytes(ByteSpan input, Now now);
  void handle_transmitted(std::size_t bytes, Now now);
  void handle_timeout(Now now);
  /// The stream is gone.
  void handle_closed(Error reason, Now now);

  // --- asked ---

  RequestId get_property(std::string_view path, std::string_view member, Now now);  ///< completes with the value
  RequestId set_property(std::string_view path, std::string_view member, const Value& value, Now now);  ///< null
  /// Completes with the return value; null for void functions.
  RequestId call_function(std::string_view path, std::string_view member, std::span<const Value> arguments, Now now);
  /// Calls a generator function; completes with int32, the generator's index, which next, close and abort take.
  RequestId open_generator(std::string_view path, std::string_view function, std::span<const Value> arguments, Now now);
  /// Completes with the next value (null where the generator has none); after the last one with the error
  /// stop_iteration. After any error the generator is gone. `parameter` there where the generator takes one.
  RequestId next_generator(std::string_view path, std::string_view function, std::int32_t index,
                           const std::optional<Value>& parameter, Now now);
  /// Ends a generator early, in order or not; complete with null.
  RequestId close_generator(std::string_view path, std::string_view function, std::int32_t index, Now now);
  RequestId abort_generator(std::string_view path, std::string_view function, std::int32_t index, Now now);
  /// Completes with a uint64 array: the dimensions of a memory, for a plain array its length.
  RequestId get_memory_dimensions(std::string_view path, std::string_view member, Now now);
  /// Completes with the items: Array, MultiDimArray, PodArray or NamedArray. Position and count have one number a
  /// dimension; out_of_range where they are not within the memory; object_not_found where the object is replaced before
  /// all have come. Split into requests below the transfer limit, each with the time of a request: what others write
  /// meanwhile may be in some parts and not in others.
  RequestId read_memory(std::string_view path, std::string_view member, std::span<const std::uint64_t> position,
                        std::span<const std::uint64_t> count, Now now);
  /// Writes all of `value`, split as read_memory(); completes with null. An error may leave a part written.
  RequestId write_memory(std::string_view path, std::string_view member, std::span<const std::uint64_t> position,
                         const Value& value, Now now);
  /// Looks up the object at `path` (see child_path()); completes with its qualified type as text. Its definition is
  /// fetched if it is not known yet. Members of an object can be used from then on.
  RequestId find_object(std::string_view path, Now now);
  /// Completes with null; values follow as WireValueReceived. One connection a wire.
  RequestId connect_wire(std::string_view path, std::string_view member, Now now);
  RequestId disconnect_wire(std::string_view path, std::string_view member, Now now);  ///< completes with null
  RequestId peek_in_value(std::string_view path, std::string_view member, Now now);    ///< completes with the value
  RequestId peek_out_value(std::string_view path, std::string_view member, Now now);   ///< completes with the value
  RequestId poke_out_value(std::string_view path, std::string_view member, const Value& value, Now now);  ///< null
  /// Sends OutValue on a connected wire. A value that still waits for a slow stream is replaced by a newer one.
  Result<> send_wire(std::string_view path, std::string_view member, const Value& value, Now now);
  /// Drops a value that send_wire() keeps because much waits for the stream.
  void drop_waiting_value(std::string_view path, std::string_view member);
  bool has_wire(std::string_view path, std::string_view member) const {
    return wires_.contains(PathMemberView{path, member});
  }
  /// Completes with the index in use, which may differ from the one asked for; any_pipe_index asks for one that the
  /// session has not had. Packets follow as PipePacketReceived, maybe at once.
  RequestId connect_pipe(std::string_view path, std::string_view member, std::int32_t index, Now now);
  /// Completes with null, also where the service has closed the endpoint already. No packets follow.
  RequestId disconnect_pipe(std::string_view path, std::string_view member, std::int32_t index, Now now);
  /// Returns  the packet's number, which PipePacketsAcknowledged names where `wants_ack`.
  /// Errors   invalid_operation: not connected; read_only_member; out_of_system_resource: too much waits for the stream
  ///          (see queued_bytes()), nothing was sent; those of pack().
  Result<std::uint32_t> send_pipe_packet(std::string_view path, std::string_view member, std::int32_t index,
                                         const Value& value, Now now, bool wants_ack = false);

  /// Keeps the acknowledgements of an endpoint's packets back, or sends those that were kept, in their order. A service
  /// that bounds how many of its packets are on the way stops meanwhile; what it sends all the same is received as
  /// ever. Held acknowledgements end with the endpoint. Unknown endpoints are ignored.
  void hold_pipe_acks(std::string_view path, std::string_view member, std::int32_t index, bool is_held, Now now);

  /// Logs in, or in as another user. `credentials` a MapString, {"password": ...} for most services. Completes with
  /// null. A service that requires a user for everything takes the login of ClientOptions, in connecting; one that does
  /// not takes only this one.
  RequestId authenticate(std::string_view username, const Value& credentials, Now now);
  RequestId logout(Now now);  ///< completes with null
  /// Asks for the attributes as they are now; completes with a MapString. A service of this library tells there what
  /// became of the values of this session's subscriptions (subscription_losses.hpp).
  RequestId get_attributes(Now now);
  /// Locks the object at `path` and all below it, until unlock() or until the client, or the user's last one, has gone.
  /// Completes with null.
  RequestId lock(std::string_view path, LockKind kind, Now now);
  RequestId unlock(std::string_view path, Now now);  ///< completes with null
  /// Waits for the monitor lock of the object at `path` and takes it. `timeout` negative: no limit. Completes with
  /// null. A service frees a monitor whose owner sends no request on the object for 30 s.
  RequestId enter_monitor(std::string_view path, std::chrono::milliseconds timeout, Now now);
  RequestId exit_monitor(std::string_view path, Now now);  ///< completes with null
  /// Does something about the lease of the object at `path`; gateways alone know leases. `deadman`  of acquire and
  /// take_over. Completes with null.
  RequestId lease(std::string_view path, LeaseCommand command, std::chrono::milliseconds deadman, Now now);

  /// Answers CallbackCalled; a void callback ignores the value. A value that does not fit the definition becomes an
  /// error that says so. For a callback that nobody takes: invalid_operation, "Callback function not set". Unknown ids
  /// are ignored.
  void reply_callback(CallbackId id, const Result<Value>& result, Now now);
  /// Forgets a request: no event follows. Nothing is sent: the service still runs it. What its late reply brings (a
  /// wire, a pipe endpoint, a generator, a lock, a monitor) is ended at once, as it is after request_timeout; a lock or
  /// a monitor only if nothing else was asked about those of its object since.
  void cancel(RequestId id);
  /// How long requests from now on may take; those that wait already keep their deadline.
  void set_request_timeout(std::chrono::milliseconds timeout) { options_.request_timeout = timeout; }
  /// Whether requests on members that follow are sent past whatever waits, as those with the modifier `urgent` are.
  void set_urgent(bool is_urgent) { is_urgent_ = is_urgent; }
  /// Orderly: tells the service, then closes (after its answer or 500 ms). SessionClosed follows.
  void disconnect(Now now);

  // --- answers ---

  std::span<const ByteSpan> poll_transmit() { return connection_.poll_transmit(); }
  /// Whether the stream should be closed now.
  bool wants_close() const { return state_ == ClientState::closed; }
  TimePoint poll_timeout() const;
  std::optional<ClientEvent> poll_event();

  // --- looked at ---

  ClientState state() const { return state_; }
  const Connection& connection() const { return connection_; }
  const TypeRegistry& types() const { return types_; }
  const MapString& attributes() const { return attributes_; }
  /// For the options of the next session with the service, or with another one that may have the same definitions.
  const std::optional<std::vector<KnownDefinitions>>& known_definitions() const { return options_.known_definitions; }
  const std::string& service() const { return options_.service; }
  /// The type of an object that was looked up; nullptr if it was not. The root's path is the service name.
  const EntityDefinition* object_type(std::string_view path) const;
  std::size_t pending_requests() const { return pending_.size(); }
  /// Whether a request waits for its answer.
  bool has_request(RequestId id) const { return pending_.contains(id); }
  /// What waits for the stream: a sender of many pipe packets waits until this is small.
  std::size_t queued_bytes() const { return connection_.queued_bytes(); }

 private:
  /// Definitions that are fetched, with all their imports, before the connect sequence or a lookup can go on.
  struct Fetch {
    std::vector<ParseResult> parsed = {};
    std::size_t bytes = 0;              ///< of their texts
    std::set<std::string> names = {};   ///< theirs
    std::set<std::string> wanted = {};  ///< imported or asked for
    std::set<std::string> asked = {};
    std::string last_asked = {};
    RequestId lookup = 0;  ///< the find_object() that waits; 0: the connect sequence
    std::string path = {};
    std::string object_type = {};

    void add(std::string_view text);
  };
  struct Pending {
    EntryType type = EntryType::null;
    const MemberDefinition* member = nullptr;
    /// find_object, wires, pipes, generators, session operations: calls, properties allocate nothing here.
    std::string path;
    TimePoint deadline;
    std::int32_t pipe_index = 0;               ///< pipes only
    bool is_abandoned = false;                 ///< of what lasts: nobody waits any more, but the reply must be acted on
    GeneratorStep step = GeneratorStep::next;  ///< generator steps only
    std::unique_ptr<MemoryTransfer> memory = {};  ///< memories only
    std::unique_ptr<Fetch> fetch = {};            ///< requests of definitions only
  };
  struct OpenCallback {
    std::uint32_t request_id = 0;  ///< the service's
    std::string path;
    const MemberDefinition* member = nullptr;
  };
  struct ClientEndpoint : PipeEndpointState {
    using PipeEndpointState::PipeEndpointState;
    bool holds_acks = false;
    std::deque<std::uint32_t> held_acks = {};  ///< numbers, in the order in which they came
  };
  /// The endpoints of one pipe. While a connect is pending, packets of unknown endpoints are kept: they may be its own.
  struct ClientPipe {
    const MemberDefinition* member = nullptr;
    std::map<std::int32_t, ClientEndpoint> endpoints = {};
    std::size_t connects = 0;                     ///< pending
    std::vector<std::int32_t> closed_early = {};  ///< closed by the service before its connect reply came
  };

  // connecting (connect.cpp)
  void start_session(Now now);
  void handle_connect_reply(const MessageEntry& entry, EntryType request, Now now);
  void request_special(EntryType type, std::string_view path, Now now);
  void request_combined(Now now);
  void add_login();
  KnownDefinitions* find_known(std::string_view name);
  void add_known_tag(std::string_view name);
  std::vector<std::string> take_definitions(const MessageEntry& entry, std::string_view name,
                                            std::vector<std::string> sent);
  void read_object_type(const MessageEntry& entry);
  Result<Value> read_attributes(const MessageEntry& entry, std::string_view name) const;
  void keep_attributes(const MessageEntry& entry);
  void advance_fetch(Fetch fetch, Now now);
  void handle_fetch_reply(const MessageEntry& entry, Fetch fetch, Now now);
  void finish_fetch(Fetch fetch, Now now);
  void fail_fetch(const Fetch& fetch, Error error);
  void become_connected(Now now);
  Result<std::string> choose_root_type() const;

  // requests
  Result<const MemberDefinition*> find_member(std::string_view path, std::string_view member, MemberKind kind) const;
  RequestId next_request_id();
  RequestId begin_request(EntryType type, std::string_view path, std::string_view member);
  void add_pending(RequestId id, EntryType type, const MemberDefinition* member, std::string_view path, Now now);
  /// The common course of a member request: look up, write elements by `write`, send, remember.
  template <class Write>
  RequestId request(EntryType type, MemberKind kind, std::string_view path, std::string_view member, Now now,
                    Write&& write);
  RequestId request_pipe(EntryType type, std::string_view path, std::string_view member, std::int32_t index, Now now);
  /// request() for other files than that of its definition.
  RequestId request_elements(EntryType type, MemberKind kind, std::string_view path, std::string_view member, Now now,
                             const std::function<Result<>(const MemberDefinition&)>& write);
  RequestId step_generator(GeneratorStep step, std::string_view path, std::string_view function, std::int32_t index,
                           const std::optional<Value>& parameter, Now now);
  // memories (memory.cpp)
  RequestId begin_memory(std::string_view path, std::string_view member, MemoryTransfer transfer, EntryType access,
                         Now now);
  void request_memory(RequestId id, const MemberDefinition& member, std::unique_ptr<MemoryTransfer> transfer, Now now);
  void handle_memory_reply(const Message& message, const MessageEntry& entry, RequestId id, Pending pending, Now now);
  Result<> take_memory_reply(const Message& message, const MessageEntry& entry, const MemberDefinition& member,
                             MemoryTransfer& transfer);
  void begin_memory_parts(const MemberDefinition& member, MemoryTransfer& transfer, std::uint32_t limit);

  RequestId fail_request(RequestId id, Error error);
  Result<> send_outgoing(Now now, bool is_urgent = false);
  /// `value`  what the request carries; null: nothing.
  RequestId request_wire(EntryType type, std::string_view path, std::string_view member, Now now,
                         const Value* value = nullptr);
  Result<> send_wire_packet(const PathMember& key, WireConnection& wire, const Value& value, Now now);
  void send_waiting_value(const PathMember& key, WireConnection& wire, Now now);

  template <class AddElements>
  RequestId request_session_op(std::string_view path, std::string_view command, Now now, AddElements&& add_elements);
  Error not_connected() const;
  static Error object_replaced(std::string_view path);
  void handle_session_op_reply(const Message& message, const MessageEntry& entry, RequestId id, std::string path,
                               Now now);

  // received
  void handle_message(const Message& message, Now now);
  void handle_entry(const Message& message, const MessageEntry& entry, Now now);
  void handle_reply(const Message& message, const MessageEntry& entry, Now now);
  Result<Value> read_reply(const Message& message, const MessageEntry& entry, const Pending& pending) const;
  void handle_type_name_reply(const MessageEntry& entry, RequestId id, std::string path, Now now);
  using Wires = std::map<PathMember, WireConnection, PathMemberLess>;
  void release_wires(std::string_view path);
  Wires::iterator find_connecting_wire(const Pending& pending, RequestId id);
  void end_late(const Message& message, const MessageEntry& entry, const Pending& pending, Now now);
  void handle_wire_connected(const Pending& pending, RequestId id);
  void handle_event(const Message& message, const MessageEntry& entry);
  void handle_wire_packet(const Message& message, const MessageEntry& entry);
  void handle_wire_closed(const MessageEntry& entry);
  void handle_path_released(std::string_view path);

  void handle_callback(const Message& message, const MessageEntry& entry, Now now);

  // pipes (pipe.cpp)
  ClientPipe* find_pipe(std::string_view path, std::string_view member);
  void handle_pipe_reply(const Message& message, const MessageEntry& entry, RequestId id, const Pending& pending,
                         Now now);
  Result<std::int32_t> open_pipe(const Message& message, const MessageEntry& entry, RequestId id,
                                 const Pending& pending, Now now);
  void handle_pipe_packets(const Message& message, const MessageEntry& entry, Now now);
  Result<> handle_pipe_packet(const Message& message, const MessageElement& element, const MessageEntry& entry,
                              ClientEndpoint& endpoint, std::int32_t index);
  void acknowledge_packet(ClientEndpoint& endpoint, std::int32_t index, std::uint32_t number);
  void send_pipe_acks(std::string_view path, std::string_view member, bool is_unreliable, Now now);
  void handle_pipe_acks(const Message& message, const MessageEntry& entry);
  void deliver_pipe_packet(std::string_view path, std::string_view member, std::int32_t index, Value&& packet);
  void tell_pipe_closed(std::string_view path, std::string_view member, std::int32_t index);
  void handle_pipe_closed(const Message& message, const MessageEntry& entry);
  void release_pipes(std::string_view path);
  void request_silent_disconnect(const std::string& path, const MemberDefinition& member, std::int32_t index, Now now);
  void end_pipe_request(const Pending& pending);
  bool abandon_request(RequestId id, TimePoint deadline);
  void answer_error(const MessageEntry& entry, const Error& error, Now now);

  template <class Happened>
  void emit(Happened&& event) {
    events_.push(std::forward<Happened>(event));
    if (events_.size() == options_.max_events) fail_unpolled();
  }
  void fail_unpolled();
  void fail(Error reason);
  void flush_wires(Now now);
  void scan_deadlines(Now now);

  ClientOptions options_;
  Connection connection_;
  TypeRegistry types_;
  ClientState state_ = ClientState::connecting;
  TimePoint opened_;
  TimePoint last_sent_;  ///< for the keep-alive
  bool has_started_ = false;
  bool service_has_tags_ = false;  ///< of definitions
  std::string root_type_;
  std::vector<std::string> root_implements_;
  MapString attributes_;
  std::uint32_t endpoint_;

  Message outgoing_;
  using PendingRequests = std::map<RequestId, Pending>;
  PendingRequests pending_;
  SpareNode<PendingRequests> spare_pending_;
  bool is_urgent_ = false;
  RequestId last_request_id_ = 0;
  TimePoint earliest_deadline_ = TimePoint::max();  ///< no pending request is due before
  TimePoint closing_deadline_ = TimePoint::max();

  std::map<std::string, const EntityDefinition*, std::less<>> objects_;
  Wires wires_;
  PathMember last_flushed_;                                            ///< of wires_: the next flush goes on behind it
  std::map<PathMember, std::uint32_t, PathMemberLess> memory_limits_;  ///< MaxTransferSize of memories that were used
  PipeStore pipe_store_;                                               ///< outlives pipes_
  std::map<PathMember, ClientPipe, PathMemberLess> pipes_;
  std::int32_t last_pipe_index_ = 0;  ///< the highest asked for or given
  bool has_closed_pipe_ = false;
  std::vector<std::pair<std::int32_t, std::uint32_t>> pipe_acks_;  ///< index and number, to be sent; reused
  CallbackId last_callback_id_ = 0;
  std::map<CallbackId, OpenCallback> callbacks_;
  Fifo<ClientEvent> events_;
};

}  // namespace rr
