// What a service session has for its application: requests to answer, and news of its client. Layer: session.
// Source: sessions spec sections 2.2..2.12.
#pragma once

#include <chrono>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "core/member/callback.hpp"
#include "core/member/generator.hpp"
#include "core/member/memory.hpp"
#include "core/session/service/authenticator.hpp"
#include "core/session/service/hosted_service.hpp"
#include "core/support/time.hpp"
#include "core/types/value.hpp"

namespace rr {

using CallId = std::uint64_t;

enum class CallKind : std::uint8_t {
  property_get,
  property_set,
  function,
  peek_in,
  peek_out,
  poke_out,
  generator_open,     ///< a call of a generator function; any value answers it
  generator_next,     ///< answered with the next value, or with the error stop_iteration after the last one
  generator_close,    ///< the client has enough: any value answers it
  generator_abort,    ///< the client wants it to stop at once: any value answers it
  memory_dimensions,  ///< answered with a uint64 array, one number a dimension
  memory_read,        ///< answered with exactly that many items; the application checks the range against the memory
  memory_write,       ///< as memory_read; any value answers it
};

/// A request for the application, to be answered exactly once with reply().
struct Called {
  CallId id = 0;
  CallKind kind = CallKind::function;
  std::shared_ptr<ServiceObject> object;
  const MemberDefinition* member = nullptr;
  std::vector<Value> arguments;  ///< function, generator_open: parameters; property_set, poke_out: the value;
                                 ///< generator_next: the parameter, where the generator takes one
  TimeSpec time = {};            ///< poke_out
  GeneratorId generator = 0;     ///< generator_...
  MemoryRange range = {};        ///< memory_read, memory_write; for the latter `arguments` holds the items
};
struct ClientConnected {
  HostedService* service = nullptr;
};
using LoginId = std::uint64_t;

/// A login to be judged by `authenticator`, which may be slow, and to be answered exactly once with answer_login().
struct LoginRequested {
  LoginId id = 0;
  std::shared_ptr<const Authenticator> authenticator;
  LoginAttempt attempt;
  LoginLimit::Ticket ticket;  ///< to be kept until the answer; null in front of a remote service
};
/// A wire was connected: send the current value, if there is one. Of a remote service: a client wants to connect it; to
/// be answered with answer_wire().
struct WireConnected {
  std::string path;
  std::shared_ptr<ServiceObject> object;
  const MemberDefinition* member = nullptr;
};
/// The client has enough of a wire. Wires that are connected when the client goes, or whose object is released, end
/// with it: there is only ClientGone or nothing.
struct WireDisconnected {
  std::string path;
  const MemberDefinition* member = nullptr;
};
/// A newer OutValue of the client.
struct WireReceived {
  std::shared_ptr<ServiceObject> object;
  const MemberDefinition* member = nullptr;
  TimeSpec time;
  Value value;
};
/// A pipe endpoint of one client; never used again in its session.
using PipeId = std::uint64_t;
/// A client wants a pipe endpoint: to be answered exactly once, with accept_pipe() or refuse_pipe().
struct PipeConnected {
  PipeId id = 0;
  std::shared_ptr<ServiceObject> object;
  const MemberDefinition* member = nullptr;
  std::int32_t index = 0;
};
struct PipeReceived {
  PipeId id = 0;
  Value value;
  /// Of a remote service: the packet's number, where the client wants to hear that it has arrived there. To be answered
  /// with acknowledge_pipe(). Packets for other services are acknowledged by the session.
  std::optional<std::uint32_t> wants_ack = {};
};
/// Packets that were sent with wants_ack have arrived.
struct PipeAcknowledged {
  PipeId id = 0;
  std::vector<std::uint32_t> numbers;
};
/// The client closed the endpoint, or sent what cannot be read, or its object was released. Endpoints that still live
/// when the client goes end with it: there is only ClientGone.
struct PipeClosed {
  PipeId id = 0;
};
/// Nothing more comes for this generator: it ended, was closed or aborted, was left alone for ten minutes, or its
/// object was released. Generators that still run when the client goes end with it: there is only ClientGone.
struct GeneratorEnded {
  GeneratorId id = 0;
};
/// This client gave up a monitor that others wait for: all sessions of the service are to be told so, with
/// handle_locks_changed().
struct LocksChanged {
  HostedService* service = nullptr;
};
/// Of a remote service: the client has logged in or out within its session.
struct UserChanged {};
/// A call of the client's callback ended: with its answer, or because it took too long or the client is gone.
struct CallbackCompleted {
  CallbackId id = 0;
  Result<Value> result;
};
/// Of a remote service: an object that the client names is not known. To be answered with handle_object_found().
struct ObjectWanted {
  std::string path;
};
using LockRequestId = std::uint64_t;
enum class LockCommand : std::uint8_t {
  lock_for_user,
  lock_for_client,
  unlock,
  enter_monitor,
  exit_monitor,
  acquire_lease,  ///< those of leases stand in the order of LeaseCommand
  take_lease,
  renew_lease,
  release_lease,
};
constexpr bool is_of_lease(LockCommand command) {
  return command >= LockCommand::acquire_lease;
}
/// Of a remote service: to be answered exactly once, with answer_lock().
struct LockWanted {
  LockRequestId id = 0;
  LockCommand command = LockCommand::unlock;
  std::string path;
  std::chrono::milliseconds timeout{0};  ///< enter_monitor; negative: for ever. acquire_lease, take_lease: dead-man's
};
/// Of a remote service: the client disconnects. Once what it holds there is given up: to be answered with
/// answer_leave(), which ends the session.
struct LeaveWanted {};
/// The last event.
struct ClientGone {
  Error reason;
};
using ServiceEvent =
    std::variant<Called, ClientConnected, LoginRequested, LocksChanged, WireConnected, WireDisconnected, WireReceived,
                 PipeConnected, PipeReceived, PipeAcknowledged, PipeClosed, GeneratorEnded, CallbackCompleted,
                 UserChanged, ObjectWanted, LockWanted, LeaveWanted, ClientGone>;

}  // namespace rr
