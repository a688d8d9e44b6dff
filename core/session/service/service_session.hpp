// The service's half of a session: one client on one connection. Layer: session.
// Source: sessions spec sections 2.2..2.9, 2.11, 2.12. The sans-IO contract stands in connection.hpp.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <unordered_map>
#include <vector>

#include "core/member/callback.hpp"
#include "core/member/event.hpp"
#include "core/member/generator.hpp"
#include "core/member/ledger.hpp"
#include "core/member/memory.hpp"
#include "core/member/pipe.hpp"
#include "core/member/wire.hpp"
#include "core/session/connection.hpp"
#include "core/session/service/authenticator.hpp"
#include "core/session/service/hosted_service.hpp"
#include "core/session/service/service_events.hpp"
#include "core/session/service_path.hpp"
#include "core/support/fifo.hpp"

namespace rr {

/// What a client is about to do with a member; without a member, with the locks of an object, or with a service: to
/// look at it, or to connect.
struct MemberAccess {
  /// Of the request or packet. null: the service index tells of a service (`path`); get_node_info: of another node
  /// (`path` is KnownNode::known_as). Nobody hears of these two whether they were refused.
  EntryType type;
  std::string_view path;
  const MemberDefinition* member;
  const AuthenticatedUser* user;  ///< null: has not logged in
};

/// What a request holds until it is answered; gone with the session, if that ends before.
class RequestPass {
 public:
  RequestPass() = default;
  RequestPass(const RequestPass&) = delete;
  RequestPass& operator=(const RequestPass&) = delete;
  virtual ~RequestPass() = default;
  /// Called once, when the client is answered: with nothing, or with an error.
  virtual void handle_answer(const Result<>&) {}
};

struct ServiceSessionOptions {
  ConnectionOptions connection;  ///< `self` is taken from the directory
  std::string base_url = {};     ///< "rr+tcp://127.0.0.1:52222/": what the service index says of this connection
  std::chrono::milliseconds connect_timeout{30'000};  ///< a connection that opens no session is closed
  /// The client's NodeID, where the transport vouches for it (a certificate; the local machine).
  std::optional<NodeId> verified_node_id = {};
  std::size_t max_open_calls = 1024;               ///< not answered yet; above, what the client sends has to wait
  std::size_t max_generators = 256;                ///< run by one client; above: out_of_system_resource
  std::uint32_t max_memory_transfer = 100 * 1024;  ///< bytes: how clients are told to split; not enforced
  std::size_t max_wires = 4096;                    ///< connected by one client; above: out_of_system_resource
  std::size_t max_open_callbacks = 1024;           ///< not answered yet; above: out_of_system_resource
  std::size_t max_pipe_endpoints = 4096;           ///< of one client; above: out_of_system_resource
  std::size_t max_pipe_queued_bytes = 32u * 1024 * 1024;  ///< waiting for the stream; above, pipes take no packets
  /// Asked before anything is done with a member or a service is told of; what it refuses with is what the client gets.
  /// None: all is allowed.
  std::function<Result<>(const MemberAccess&)> admit = {};
  /// Asked behind `admit` for each request to a member, unless it ends something; packets are none. What it returns is
  /// kept until the request is answered; what it refuses with is what the client gets, and nothing is lost by it. None:
  /// as many as may come.
  std::function<Result<std::shared_ptr<RequestPass>>(const MemberAccess&)> enter = {};
  /// Told of the service that is connected to, beside its own attributes.
  MapString attributes = {};
  /// Why a service is not there that the node would have otherwise; nullopt: there is none. Asked for those who may
  /// know of it. None: as nullopt.
  std::function<std::optional<Error>(std::string_view service)> why_missing = {};
  /// With it nothing is served here: the first request for a service fails so, and the session ends behind it.
  std::optional<Error> refusal = {};
};

/// One client of a node. Node-level requests (definitions, attributes, the service index) are answered in here.
class ServiceSession {
 public:
  ServiceSession(ServiceDirectory& directory, ServiceSessionOptions options, Now now);
  ServiceSession(const ServiceSession&) = delete;
  ServiceSession& operator=(const ServiceSession&) = delete;
  ~ServiceSession();

  // --- told ---

  /// Returns  bytes consumed: all, unless so many calls wait for their answers, or so many answers for who has not
  ///          logged in, that the rest has to wait, too. It is to be given again when events were handled, calls
  ///          answered or bytes sent.
  std::size_t handle_bytes(ByteSpan input, Now now);
  void handle_transmitted(std::size_t bytes, Now now);
  bool handle_lent(const LentMessage& lent, std::size_t bytes, Now now) {
    return connection_.handle_lent(lent, bytes, now);
  }
  void handle_timeout(Now now);
  void handle_closed(Error reason, Now now);
  /// Another session of the service had the event LocksChanged.
  void handle_locks_changed(Now now);

  // --- asked ---

  /// Answers a call. Property set, poke and void functions ignore the value. A value that does not fit the definition
  /// becomes an error reply that says so. Unknown ids (the client is gone) are ignored.
  void reply(CallId id, const Result<Value>& result, Now now);
  /// Ends a login. Unknown ids (the client is gone) are ignored.
  void answer_login(LoginId id, Result<AuthenticatedUser> result, Now now);
  /// Clients that still have to log in are sent nothing.
  /// Errors   those of packing; connection_error.
  Result<> send_event(std::string_view path, const MemberDefinition& member, std::span<const Value> arguments, Now now);
  /// The same for an event that others are sent as well. `lent`: see Connection::send().
  Result<> send_event(EventPacket& packet, Now now, LentMessage* lent = nullptr);
  /// Sends InValue if the client has connected this wire; a value that waits for a slow stream is replaced.
  Result<> send_wire(std::string_view path, const MemberDefinition& member, const Value& value, Now now);
  /// The same for a value that others are sent as well, with its own time.
  Result<> send_wire(WirePacket& packet, Now now, LentMessage* lent = nullptr);
  /// Values of a wire were replaced before they came here: for its ledger.
  void note_conflated(std::string_view path, const MemberDefinition& member, std::uint64_t count);
  /// Answers WireConnected of a remote service, where it is not answered yet.
  void answer_wire(std::string_view path, const MemberDefinition& member, const Result<>& result, Now now);
  /// Ends the client's connection to this wire, if it has one, and tells the client.
  void close_wire(std::string_view path, const MemberDefinition& member, Now now);
  /// Answers PipeConnected. Unknown ids, answered and closed ones are ignored.
  void accept_pipe(PipeId id, Now now);
  void refuse_pipe(PipeId id, const Error& error, Now now);
  /// Sends a packet; accepts the endpoint first where that was not done yet.
  /// Returns  the packet's number, which PipeAcknowledged names where `wants_ack`.
  /// Errors   invalid_operation: closed; write_only_member; out_of_system_resource: too much waits for the stream (see
  ///          queued_bytes()), nothing was sent; those of pack().
  Result<std::uint32_t> send_pipe_packet(PipeId id, const Value& value, Now now, bool wants_ack = false);
  /// The same for a packet that others are sent as well.
  Result<std::uint32_t> send_pipe_packet(PipeId id, SharedPipePacket& packet, Now now, LentMessage* lent = nullptr);
  /// Answers PipeReceived of a remote service. Unknown ids (the endpoint is closed) are ignored.
  void acknowledge_pipe(PipeId id, std::span<const std::uint32_t> numbers, Now now);
  /// Closes the endpoint and tells the client; no event follows.
  void close_pipe(PipeId id, Now now);
  /// Calls a callback of the client. Every call that begins ends in exactly one CallbackCompleted; its value is null
  /// for void callbacks. Errors   connection_error; out_of_system_resource: too many calls are not answered yet; those
  /// of packing.
  Result<CallbackId> call_callback(std::string_view path, const MemberDefinition& member,
                                   std::span<const Value> arguments, Now now);
  /// Whether the client has asked for the object of that path, or of its service's root object.
  bool uses(std::string_view path) const {
    return service_ && (path == service_->name() || used_objects_.find(path) != used_objects_.end());
  }
  /// Tells the client to look up `path` again, unless it still has to log in.
  void release_path(std::string_view path, Now now);
  /// Answers ObjectWanted: the service has the object now (HostedService::add_object()), or not.
  void handle_object_found(std::string_view path, const Result<>& found, Now now);
  /// Answers LockWanted. Unknown ids (the client is gone) are ignored.
  void answer_lock(LockRequestId id, const Result<>& result, Now now);
  /// Answers LeaveWanted.
  void answer_leave(Now now);
  /// Tells the client that its service is gone (ServiceClosed), unless it still has to log in, then closes.
  void close_service(Now now);

  // --- answers ---

  std::span<const ByteSpan> poll_transmit() { return connection_.poll_transmit(); }
  /// Whether the stream should be closed now.
  bool wants_close() const { return connection_.state() == ConnectionState::closed; }
  TimePoint poll_timeout() const;
  std::optional<ServiceEvent> poll_event();

  // --- looked at ---

  const Connection& connection() const { return connection_; }
  /// The service that the client is connected to; nullptr before and after.
  HostedService* service() const { return service_.get(); }
  bool has_wire(std::string_view path, std::string_view member) const;
  /// Calls `visit(path, member, ledger)` for each wire and pipe endpoint that the client has connected.
  template <class Visit>
  void visit_ledgers(Visit&& visit) const {
    for (const auto& [key, wire] : wires_) visit(key.path, *wire.member, wire.ledger);
    for (const auto& [id, pipe] : pipes_) visit(pipe.key->path, pipe.state.member(), pipe.ledger);
  }
  /// Of all wires and pipes that the client ever had connected here.
  Ledgers total_ledgers() const;
  /// Whether ServiceSessionOptions::admit lets the client have this of a member, or of a service (null).
  bool admits(EntryType type, std::string_view path, const MemberDefinition* member) const {
    return admit(type, path, member).has_value();
  }
  /// Who has logged in; nullptr while nobody has.
  const AuthenticatedUser* user() const { return user_ ? &*user_ : nullptr; }
  /// This side's number of the session; 0 before the client is connected.
  std::uint32_t endpoint() const { return endpoint_; }
  /// What waits for the stream: a sender of many pipe packets waits until this is small.
  std::size_t queued_bytes() const { return connection_.queued_bytes(); }
  /// All that is kept for this client beside its state: what waits for the stream, what has come of a message that is
  /// not complete, and requests that wait for an object.
  std::size_t held_bytes() const;
  /// Above these, pipes take no packets.
  std::size_t max_pipe_queued_bytes() const { return options_.max_pipe_queued_bytes; }

 private:
  struct OpenCall {
    CallId id = 0;
    EntryType type = EntryType::null;  ///< of the request
    std::uint32_t request_id = 0;
    std::string path;
    const MemberDefinition* member = nullptr;
    GeneratorId generator = 0;
    GeneratorStep step = GeneratorStep::next;
    std::unique_ptr<const MemoryRange> range = {};  ///< reads and writes of memories
    bool wants_dim_count = false;                   ///< memories: of the dimensions, only how many
  };

  /// A client that waits for a monitor hears of it at least that often.
  static constexpr std::chrono::seconds longest_wait{5};
  /// A MonitorEnter or MonitorContinueEnter that is not answered yet.
  struct OpenEnter {
    std::uint32_t request_id = 0;
    std::string path;
    std::string member;
    std::shared_ptr<ServiceObject> object;
    TimePoint answer_by;
  };
  /// A login that is being judged.
  struct OpenLogin {
    LoginId id = 0;
    EntryType type = EntryType::null;  ///< of the request: connect_client_combined or client_session_op_req
    std::uint32_t request_id = 0;
    std::string path;
    std::string member;
    std::shared_ptr<HostedService> service;
    // connect_client_combined
    NodeIdentity client;
    std::uint32_t client_endpoint = 0;
    Version client_version = {};
    const EntityDefinition* type_for_client = nullptr;
    bool wants_definitions = true;
    std::optional<std::string> known_tag =
        {};  ///< of the definitions that it has, maybe empty; nullopt: it has not said
  };
  /// A request that waits for its object to be found.
  struct ParkedRequest {
    std::string path;
    Bytes message;
    std::size_t entry = 0;
  };
  /// A LockWanted. MonitorEnter is answered "Continue" now and then; the client then asks again.
  struct OpenLock {
    LockRequestId id = 0;
    std::uint32_t request_id = 0;  ///< of the request that waits; none between two of them
    bool is_asked = true;
    std::string path;
    std::string member;
    bool is_monitor_enter = false;
    TimePoint answer_by = TimePoint::max();
    std::optional<Result<>> result = {};  ///< came between two requests
  };
  struct OpenCallback {
    const MemberDefinition* member = nullptr;
    TimePoint deadline;
  };
  struct ServicePipe {
    ServicePipe(const MemberDefinition& member, PipeStore& store) : state(member, store, PipeState::connecting) {}

    PipeEndpointState state;
    PipeId id = 0;
    const PathMember* key = nullptr;  ///< in pipe_indices_
    std::int32_t index = 0;
    std::uint32_t request_id = 0;  ///< of the connect
    bool is_unreliable = false;    ///< defined and asked for
    Ledger ledger;
  };
  using PipeIndices = std::map<std::int32_t, ServicePipe*>;
  enum class PipeEnd : std::uint8_t { service, client };
  /// Of a pipe the highest that each side has closed.
  struct ClosedIndices {
    std::int32_t by_service = any_pipe_index;
    std::int32_t by_client = any_pipe_index;
  };

  bool takes_requests() const { return calls_.size() < options_.max_open_calls && !connection_.is_held_back(); }
  void handle_message(const Message& message, Now now);
  bool is_of_session(const MessageHeader& header) const;
  void send_outgoing(Now now, bool is_urgent = false);
  void leave(Error reason, Now now);
  using Wires = std::map<PathMember, WireConnection, PathMemberLess>;
  /// Returns the one behind it.
  Wires::iterator end_wire(Wires::iterator wire);
  Ledgers& ended();
  void end_all_wires();
  void release_wires(std::string_view path, const Error& why, Now now);
  Result<HostedService::Found> find_object(std::string_view path);

  // node-level requests (special.cpp)
  void handle_special(const Message& message, Now now);
  Result<> answer_special(const Message& message, const MessageEntry& entry, Now now);
  static Result<Version> read_client_version(const Message& message, const MessageEntry& entry);
  Result<> write_service_desc(const Message& message, const MessageEntry& entry);
  Result<> write_root_type(const Message& message, const MessageEntry& entry);
  Result<> write_combined(const Message& message, const MessageEntry& entry, Now now);
  Result<> accept_combined(const OpenLogin& request, std::optional<AuthenticatedUser> user, Now now);
  Result<> connect(std::shared_ptr<HostedService> service, const NodeId& client, std::uint32_t client_endpoint,
                   std::optional<AuthenticatedUser> user, Now now);
  Result<> disconnect(const Message& message, const MessageEntry& entry, Now now);
  /// A MapString (losses.cpp).
  Value attributes_with_losses() const;
  Result<> write_attributes(std::string_view element, const HostedService& service);
  /// Those of the service, and of ServiceSessionOptions.
  MapString attributes_of(const HostedService& service) const;

  // logins (login.cpp)
  bool may_use_service() const;
  Result<> check_login(EntryType type) const;
  Result<> begin_login(const Message& message, const MessageEntry& entry, std::shared_ptr<HostedService> service,
                       Now now);
  void finish_combined(const OpenLogin& login, Result<AuthenticatedUser> result, Now now);
  void finish_authenticate(const OpenLogin& login, Result<AuthenticatedUser> result, Now now);
  Result<> answer_session_op(const Message& message, const MessageEntry& entry, Now now);

  // locks (locks.cpp)
  Result<> check_locks(const MessageEntry& entry, const HostedService::Found& found, const MemberDefinition& member,
                       Now now);
  Result<> answer_object_lock(const MessageEntry& entry, Now now);
  Result<> answer_monitor(const Message& message, const MessageEntry& entry, Now now);
  static Result<std::chrono::milliseconds> read_monitor_timeout(const Message& message, const MessageEntry& entry);
  /// Of OpenEnter or OpenLock. `answer`  the text that the client gets.
  template <class Request>
  void answer_lock_request(const Request& request, const Result<std::string_view>& answer, Now now) {
    send_session_op_reply(request.path, request.member, request.request_id, answer, now);
  }
  void send_session_op_reply(std::string_view path, std::string_view member, std::uint32_t request_id,
                             const Result<std::string_view>& answer, Now now);
  TimePoint next_enter_deadline() const;
  void tell_others_of_monitors();
  void leave_monitors();
  void leave_locks();
  void set_user(std::optional<AuthenticatedUser> user, Now now);
  void change_user(std::optional<AuthenticatedUser> user, Now now);

  // requests of the session
  void handle_entry(const Message& message, const MessageEntry& entry, Now now);
  Result<> answer_session_request(const Message& message, const MessageEntry& entry);
  Result<> dispatch_member(const Message& message, const MessageEntry& entry, Now now);
  Result<> add_call(const Message& message, const MessageEntry& entry, CallKind kind, HostedService::Found found,
                    const MemberDefinition& member);
  Result<> check_room_for_call() const;
  Result<> answer_wire(const MessageEntry& entry, const HostedService::Found& found, const MemberDefinition& member,
                       Now now);
  Result<> answer_service_index(const MessageEntry& entry, const MemberDefinition& member, Now now);
  void handle_wire_packet(const Message& message, const MessageEntry& entry);

  // remote services (remote.cpp)
  bool must_wait_for_object(const MessageEntry& entry) const;
  Result<> park(const Message& message, const MessageEntry& entry);
  Result<> ask_for_lock(const Message& message, const MessageEntry& entry, Now now);
  Result<> continue_entering(const MessageEntry& entry, Now now);
  void continue_late_locks(Now now);

  Result<> admit(EntryType type, std::string_view path, const MemberDefinition* member) const {
    return admit(type, path, member, user());
  }
  Result<> admit(EntryType type, std::string_view path, const MemberDefinition* member,
                 const AuthenticatedUser* user) const;
  Result<> admit_special(const Message& message, const MessageEntry& entry) const;
  Error missing_service(std::string_view name) const;
  /// Until `outgoing_` is sent, texts of the service's definitions stay what they are.
  const TypeRegistry& keep_types(const HostedService& service);
  const ServiceDefinition* find_definition(std::string_view service, std::string_view name);
  Result<> enter(const MessageEntry& entry, const MemberDefinition& member);
  bool refuse_reused_id(const MessageEntry& entry, Now now);
  void answer_pass(const MessageEntry& answer);
  std::shared_ptr<RequestPass> release_pass(std::uint32_t request_id);

  // callbacks (callback.cpp)
  void handle_callback_reply(const Message& message, const MessageEntry& entry);
  void expire_callbacks(Now now);
  void end_callbacks(const Error& reason);

  // pipes (pipe.cpp)
  Result<> connect_pipe(const Message& message, const MessageEntry& entry, const HostedService::Found& found,
                        const MemberDefinition& member);
  Result<> disconnect_pipe(const Message& message, const MessageEntry& entry, const MemberDefinition& member, Now now);
  void handle_pipe_packets(const Message& message, const MessageEntry& entry, Now now);
  Result<> handle_pipe_packet(const Message& message, const MessageElement& element, ServicePipe& pipe);
  void handle_pipe_acks(const Message& message, const MessageEntry& entry);
  /// `why`  for those that wait for an answer.
  void release_pipes(std::string_view path, const Error& why, Now now);
  void send_pipe_acks(std::string_view path, std::string_view member, bool is_unreliable, Now now);
  ServicePipe* find_pipe(PipeId id);
  ServicePipe* find_pipe(const MessageEntry& entry, std::int32_t index);
  void forget_pipe(PipeId id);
  void leave_pipe(PipeId id, PipeEnd by);
  /// `send(pipe, number)` of the next packet's number, which it takes where that succeeds.
  template <class Send>
  Result<std::uint32_t> send_numbered(PipeId id, Now now, Send&& send);

  // generators (generator.cpp)
  Result<> open_generator(const Message& message, const MessageEntry& entry, HostedService::Found found,
                          const MemberDefinition& member);
  Result<> step_generator(const Message& message, const MessageEntry& entry, HostedService::Found found,
                          const MemberDefinition& member, Now now);
  Result<> write_generator_reply(const OpenCall& call, const Value& value, Now now);
  void finish_generator_call(const OpenCall& call, bool has_failed, Now now);
  void end_generators(const std::vector<GeneratorId>& ended);

  // memories (memory.cpp)
  Result<> answer_memory(const Message& message, const MessageEntry& entry, HostedService::Found found,
                         const MemberDefinition& member, Now now);
  Result<> check_memory_size(const MemoryRange& range, const MemberDefinition& member) const;
  Result<> write_memory_reply(const OpenCall& call, const Value& value);

  void begin_reply(const MessageEntry& request);
  /// What the application says, whose parameter may be of the service's types.
  void write_own_error(const Error& error);
  void send_error(const MessageEntry& request, const Error& error, Now now);
  Result<> send_wire_packet(WireConnection& wire, WirePacket& packet, Now now, LentMessage* lent);
  void flush_wires(Now now);

  ServiceDirectory& directory_;
  ServiceSessionOptions options_;
  Connection connection_;
  std::shared_ptr<HostedService> service_;
  std::uint32_t endpoint_ = 0;
  NodeId client_node_;  ///< as it called itself when it connected
  TimePoint opened_;
  TimePoint last_session_message_;
  std::optional<TimePoint> closing_deadline_;
  bool is_gone_ = false;

  Message outgoing_;
  Value told_attributes_;     ///< borrowed by outgoing_
  Value session_attributes_;  ///< likewise
  SessionId session_id_ = 0;  ///< while service_ is set
  /// Paths of objects that the client has asked for, and what has the service remember them meanwhile.
  std::map<std::string, std::shared_ptr<const void>, std::less<>> used_objects_;
  std::vector<OpenEnter> enters_;
  std::optional<AuthenticatedUser> user_;
  std::unique_ptr<OpenLogin> login_;
  LoginId last_login_id_ = 0;
  std::size_t failed_logins_ = 0;

  CallId last_call_id_ = 0;
  std::vector<OpenCall> calls_;
  std::unordered_map<std::uint32_t, std::shared_ptr<RequestPass>> passes_;  ///< of requests, until they are answered
  GeneratorTable generators_;
  Wires wires_;
  PathMember last_flushed_;         ///< of wires_: the next flush goes on behind it
  std::unique_ptr<Ledgers> ended_;  ///< of wires and pipes that are no more; null: there were none
  /// A DisconnectClient that is not answered yet.
  struct OpenLeave {
    NodeIdentity client;
    std::uint32_t client_endpoint = 0;
    std::string path;
    std::string member;
    std::uint32_t request_id = 0;
  };
  std::unique_ptr<OpenLeave> leaving_;
  std::vector<ParkedRequest> parked_;
  LockRequestId last_lock_id_ = 0;
  std::vector<OpenLock> locks_;  ///< at most a handful
  CallbackId last_callback_id_ = 0;
  std::map<CallbackId, OpenCallback> callbacks_;  ///< in order of their deadlines, which are equally far
  PipeStore pipe_store_;                          ///< outlives pipes_
  PipeId last_pipe_id_ = 0;
  std::map<PipeId, ServicePipe> pipes_;                             ///< mostly none or one
  std::map<PathMember, PipeIndices, PathMemberLess> pipe_indices_;  ///< the same pipes
  std::map<PathMember, ClosedIndices, PathMemberLess> closed_indices_;
  std::vector<std::pair<std::int32_t, std::uint32_t>> pipe_acks_;  ///< index and number, to be sent; reused
  Fifo<ServiceEvent> events_;
};

}  // namespace rr
