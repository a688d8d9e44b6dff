// rr::ClientSession for JavaScript: the same four kinds of method, with JavaScript values. Layer: wasm-client/src.
// Called by ts/wasm_module.ts alone, which documents the shapes in TypeScript.
#pragma once

#include <optional>
#include <set>

#include "core/session/client/client_session.hpp"
#include "wasm-client/src/js_writer.hpp"

namespace rr {

/// Strings and values come in as JavaScript has them. Times are milliseconds: `steady` of performance.now(), `utc` of
/// Date.now(). Requests return an id, or 0 for what cannot be asked: take_error() then says why.
class WasmSession {
 public:
  WasmSession(ClientOptions options, double steady, double utc);

  /// The clocks; to be set before every call that follows at another time.
  void set_now(double steady, double utc);

  // --- told ---

  /// Where to put `size` received bytes before handle_bytes(size): one buffer that is reused and grows.
  std::uint8_t* receive_buffer(std::size_t size);
  void handle_bytes(std::size_t size);
  void handle_transmitted(std::size_t size);
  void handle_timeout();
  void handle_closed(const JsValue& reason);

  // --- asked ---

  /// For requests from now on.
  void set_request_timeout(double milliseconds);
  void set_urgent(bool is_urgent) { session_.set_urgent(is_urgent); }
  using MemberRequest = RequestId (ClientSession::*)(std::string_view path, std::string_view member, Now now);
  using ValueRequest = RequestId (ClientSession::*)(std::string_view path, std::string_view member, const Value& value,
                                                    Now now);
  /// A request that needs no more than the member; its reply may hold a value of the member's type.
  RequestId ask(MemberRequest request, const JsValue& path, const JsValue& member);
  /// A request that hands over a value of the member's type.
  RequestId ask(ValueRequest request, const JsValue& path, const JsValue& member, const JsValue& value);
  RequestId call_function(const JsValue& path, const JsValue& member, const JsValue& arguments);
  RequestId open_generator(const JsValue& path, const JsValue& member, const JsValue& arguments);
  /// `parameter` for GeneratorStep::next, undefined where the generator takes none.
  RequestId step_generator(GeneratorStep step, const JsValue& path, const JsValue& member, std::int32_t index,
                           const JsValue& parameter);
  /// `position`, `count`: arrays, one number a dimension.
  RequestId read_memory(const JsValue& path, const JsValue& member, const JsValue& position, const JsValue& count);
  RequestId write_memory(const JsValue& path, const JsValue& member, const JsValue& position, const JsValue& value);
  RequestId find_object(const JsValue& path);
  /// Returns  whether it was sent or queued.
  bool send_wire(const JsValue& path, const JsValue& member, const JsValue& value);
  RequestId connect_pipe(const JsValue& path, const JsValue& member, std::int32_t index);
  RequestId disconnect_pipe(const JsValue& path, const JsValue& member, std::int32_t index);
  /// Returns  the packet's number, or -1: take_error() then says why.
  double send_pipe_packet(const JsValue& path, const JsValue& member, std::int32_t index, const JsValue& value,
                          bool wants_ack);
  /// `credentials` an object or Map, as varvalues.
  RequestId authenticate(const JsValue& username, const JsValue& credentials);
  RequestId logout();
  RequestId get_attributes();
  RequestId lock(const JsValue& path, LockKind kind);
  RequestId unlock(const JsValue& path);
  /// `milliseconds` below 0: no limit.
  RequestId enter_monitor(const JsValue& path, double milliseconds);
  RequestId exit_monitor(const JsValue& path);
  RequestId lease(const JsValue& path, LeaseCommand command, double deadman);
  /// Answers a callback with what its handler returned. Returns undefined, or why that does not fit: the service is
  /// told so, too.
  JsValue reply_callback(double id, const JsValue& path, const JsValue& member, const JsValue& value);
  /// `error` {code, name, subName, message}
  void fail_callback(double id, const JsValue& error);
  void cancel(RequestId id);
  void disconnect();

  // --- answers ---

  /// The next bytes to send, at most `limit`; to be reported with handle_transmitted() before the next poll.
  ByteSpan poll_transmit(std::size_t limit);
  bool wants_close() const;
  /// When to call handle_timeout(), by performance.now(); Infinity for never.
  double poll_timeout() const;
  /// {kind, ...} or undefined.
  JsValue poll_event();
  JsValue take_error();

  // --- looked at ---

  std::size_t queued_bytes() const;
  /// {messagesReceived, messagesSent, bytesReceived, bytesSent}
  JsValue stats() const;
  /// {id, name} of the service's node.
  JsValue peer() const;
  JsValue attributes() const;
  /// See make_js_definition(); undefined where there is none of this name.
  JsValue definition(const JsValue& name) const;
  /// The texts of all definitions, imports first.
  JsValue definitions() const;
  /// What the service named by a tag, for the option `known` of a later session: [[name, tag, text...]...].
  JsValue known_definitions() const;
  /// The members of an object that was found (see make_js_members()); undefined for others.
  JsValue members(const JsValue& path) const;

 private:
  /// The member that a request is for.
  struct Target {
    std::string path;
    std::string member;
    const MemberDefinition* definition;
  };
  /// Nothing where there is no such member, or no session (any more): error_ says why.
  std::optional<Target> find_target(const JsValue& path, const JsValue& member);
  const MemberDefinition* find_member(std::string_view path, std::string_view member) const;
  /// Nothing: error_ says why.
  std::optional<Value> read_value(const JsValue& js, const TypeDefinition& type, std::string_view name);
  /// An array of numbers from 0 on; nothing: error_ says why.
  std::optional<Value> read_range(const JsValue& js, std::string_view name);
  /// Those of a function that a call hands over; nothing: error_ says why.
  std::optional<std::vector<Value>> read_arguments(const JsValue& arguments, const MemberDefinition& function);
  /// Returns `id`, whose reply holds a value of the type.
  RequestId remember(RequestId id, const TypeDefinition& type);
  JsValue event_to_js(const ClientEvent& event);
  void write_event(JsWriter& js, const Connected& event);
  void write_event(JsWriter& js, const Completed& event);
  void write_event(JsWriter& js, const EventReceived& event);
  void write_event(JsWriter& js, const CallbackCalled& event);
  void write_event(JsWriter& js, const WireValueReceived& event);
  void write_event(JsWriter& js, const WireClosedByService& event);
  void write_event(JsWriter& js, const PipePacketReceived& event);
  void write_event(JsWriter& js, const PipePacketsAcknowledged& event);
  void write_event(JsWriter& js, const PipeClosedByService& event);
  void write_event(JsWriter& js, const PathReleased& event);
  void write_event(JsWriter& js, const SessionClosed& event);
  template <class Event>
  void write_member_value(JsWriter& js, const Event& event) const;

  Now now_;
  ClientSession session_;
  std::optional<Error> error_;  ///< of the last request
  Bytes received_;
  std::set<RequestId> varvalue_replies_;  ///< requests whose value brings its type along
};

}  // namespace rr
