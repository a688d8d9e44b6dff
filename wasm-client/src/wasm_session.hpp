// rr::ClientSession for JavaScript: the same four kinds of method, with JavaScript values. Layer: wasm-client/src.
// Called by ts/wasm_module.ts alone, which documents the shapes in TypeScript.
#pragma once

#include <optional>
#include <unordered_set>

#include "core/session/client_session.hpp"
#include "wasm-client/src/js_access.hpp"

namespace rr {

/// Strings come in as `val`, so that no call leaves destructors of its own in embind's hands while a getter of the
/// application, read on the way, calls in again. Times are milliseconds: `steady` of performance.now(), `utc` of
/// Date.now(). Requests return an id, or 0 for arguments that do not fit: take_error() then says why.
class WasmSession {
 public:
  WasmSession(val options, double steady, double utc);

  /// The clocks; to be set before every call that follows at another time.
  void set_now(double steady, double utc);

  // --- told ---

  /// Where to put `size` received bytes before handle_bytes(size): one buffer that is reused and grows.
  std::uintptr_t receive_buffer(std::size_t size);
  void handle_bytes(std::size_t size);
  void handle_transmitted(std::size_t size);
  void handle_timeout();
  void handle_closed(val reason);

  // --- asked ---

  /// For requests from now on.
  void set_request_timeout(double milliseconds);
  std::uint32_t get_property(val path, val member);
  std::uint32_t set_property(val path, val member, val value);
  std::uint32_t call_function(val path, val member, val arguments);
  std::uint32_t find_object(val path);
  std::uint32_t connect_wire(val path, val member);
  std::uint32_t disconnect_wire(val path, val member);
  std::uint32_t peek_in_value(val path, val member);
  std::uint32_t peek_out_value(val path, val member);
  std::uint32_t poke_out_value(val path, val member, val value);
  /// Returns  whether it was sent or queued.
  bool send_wire(val path, val member, val value);
  void cancel(std::uint32_t id);
  void disconnect();

  // --- answers ---

  /// The next bytes to send as a Uint8Array on the heap, undefined where there are none; to be reported with
  /// handle_transmitted() before the next poll. At most `limit` bytes.
  val poll_transmit(std::size_t limit);
  bool wants_close() const;
  /// When to call handle_timeout(), by performance.now(); Infinity for never.
  double poll_timeout() const;
  /// {kind, ...} or undefined.
  val poll_event();
  val take_error();

  // --- looked at ---

  std::size_t queued_bytes() const;
  /// {messagesReceived, messagesSent, bytesReceived, bytesSent}
  val stats() const;
  /// {id, name} of the service's node.
  val peer() const;
  val attributes() const;
  /// The texts of all definitions, imports first.
  val definitions() const;
  /// The members of an object that was found (see make_js_members()); undefined for others.
  val members(val path) const;
  /// The path of an object below `parent`; `index` undefined, or its text.
  val child_path(val parent, val member, val index) const;

 private:
  const MemberDefinition* find_member(std::string_view path, std::string_view member) const;
  /// Nothing: error_ says why.
  std::optional<Value> read_value(const JsValue& js, const TypeDefinition& type, std::string_view name);
  /// 0 and error_, for an object or member that is not there.
  RequestId refuse(std::string_view path, std::string_view member);
  RequestId remember(RequestId id, std::string_view path, std::string_view member);
  val event_to_js(const ClientEvent& event);

  std::optional<ClientSession> session_;
  std::optional<Error> failure_;  ///< of the options: there is no session then
  std::optional<Error> error_;    ///< of the last request
  Now now_;
  Bytes received_;
  std::unordered_set<RequestId> varvalue_replies_;  ///< requests whose value brings its type along
};

}  // namespace rr
