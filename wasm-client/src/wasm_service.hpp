// rr::ServiceSession for JavaScript: one service, and a session with each client of it. Layer: wasm-client/src.
// Called by ts/serve/service_module.ts alone, which documents the shapes in TypeScript.
#pragma once

#include <map>
#include <memory>
#include <optional>
#include <unordered_map>

#include "core/session/service/service_session.hpp"
#include "wasm-client/src/js_access.hpp"

namespace rr {

/// The node of a page with its one service. Objects are JavaScript's: what their members do is asked by events.
/// Times are as in WasmSession. What can fail returns undefined, or the error.
class WasmService {
 public:
  /// `options`  {nodeId, nodeName, service, type, definitions: [text], maxMessageSize}, all of them.
  /// `root`     the root object, as events name it.
  static Result<std::unique_ptr<WasmService>> make(const JsValue& options, const JsValue& root);

  void set_now(double steady, double utc);
  /// A client has connected. `url`  of the page as a device of the gateway, for the service index. Returns its number.
  std::uint32_t open(const JsValue& url);
  /// Its session is over and is forgotten.
  void forget(std::uint32_t client) { clients_.erase(client); }

  // --- told ---

  std::uint8_t* receive_buffer(std::size_t size);
  void handle_bytes(std::uint32_t client, std::size_t size);
  void handle_transmitted(std::uint32_t client, std::size_t size);
  void handle_timeout(std::uint32_t client);
  void handle_closed(std::uint32_t client, const JsValue& reason);

  // --- asked ---

  JsValue reply(std::uint32_t client, double call, const JsValue& value);
  void fail(std::uint32_t client, double call, const JsValue& error);
  /// `type`  of the object at `path`.
  JsValue send_event(const JsValue& path, const JsValue& type, const JsValue& member, const JsValue& arguments);
  /// `client`  0: all.
  JsValue send_wire(std::uint32_t client, const JsValue& path, const JsValue& type, const JsValue& member,
                    const JsValue& value);
  void accept_pipe(std::uint32_t client, double pipe);
  void refuse_pipe(std::uint32_t client, double pipe, const JsValue& error);
  JsValue send_pipe(std::uint32_t client, double pipe, const JsValue& value);
  void close_pipe(std::uint32_t client, double pipe);
  /// Returns  the call's number, or the error.
  JsValue call_callback(std::uint32_t client, const JsValue& path, const JsValue& type, const JsValue& member,
                        const JsValue& arguments);
  /// The objects at `path` and below are others now.
  void release(const JsValue& path);
  void close_service();

  // --- answers ---

  ByteSpan poll_transmit(std::uint32_t client, std::size_t limit);
  bool wants_close(std::uint32_t client) const;
  double poll_timeout(std::uint32_t client) const;
  JsValue poll_event(std::uint32_t client);

  // --- looked at ---

  std::size_t queued_bytes(std::uint32_t client) const;
  /// See make_js_members(); undefined where there is no such object type.
  JsValue members(const JsValue& type) const;

 private:
  struct Call {
    CallKind kind;
    const MemberDefinition* member;
  };
  struct Client {
    std::unique_ptr<ServiceSession> session;
    Bytes waiting;          ///< what the session does not take yet
    bool is_ended = false;  ///< too much waits
    std::unordered_map<CallId, Call> calls;
    std::unordered_map<PipeId, const MemberDefinition*> pipes;
    std::unordered_map<CallbackId, const MemberDefinition*> callbacks;
  };

  WasmService(NodeIdentity node, std::size_t max_message_size);
  Client* find(std::uint32_t client);
  const Client* find(std::uint32_t client) const;
  void feed(Client& client, ByteSpan bytes);
  Result<const MemberDefinition*> find_member(const JsValue& type, const JsValue& member) const;
  Result<Value> read_value(const JsValue& js, const TypeDefinition& type, std::string_view name) const;
  Result<std::vector<Value>> read_arguments(const JsValue& js, const MemberDefinition& member) const;
  JsValue error_or_nothing(const Result<>& result) const;
  /// undefined for what is no business of the page.
  JsValue event_to_js(Client& client, ServiceEvent& event);
  JsValue to_js_call(Client& client, const Called& called) const;

  Now now_;
  ServiceDirectory directory_;
  std::size_t max_message_size_;
  std::shared_ptr<TypeRegistry> types_ = std::make_shared<TypeRegistry>();
  std::shared_ptr<HostedService> service_;
  std::map<std::uint32_t, Client> clients_;
  std::uint32_t last_client_ = 0;
  Bytes received_;
};

}  // namespace rr
