// One client's endpoint of a pipe, as the service's handlers hold it. Layer: node/service.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <vector>

#include "core/session/service/service_session.hpp"
#include "node/service/caller.hpp"
#include "node/values/handler.hpp"

namespace rr {

/// The backlog of broadcasts that ask for no acknowledgements.
inline constexpr std::int32_t no_backlog_limit = -1;

/// What an endpoint needs of its client.
class PipeSender {
 public:
  virtual Result<std::uint32_t> send_pipe_packet(PipeId id, const Value& value) = 0;
  virtual Result<std::uint32_t> send_pipe_packet(PipeId id, SharedPipePacket& packet) = 0;
  virtual void close_pipe(PipeId id) = 0;
  virtual std::size_t queued_bytes() const = 0;

 protected:
  ~PipeSender() = default;
};

/// A handle that is cheap to copy and may be kept: when the endpoint is closed, whoever closed it, it sends nothing any
/// more and says so. For the node's thread.
class PipeEndpoint {
 public:
  ClientId client() const { return state_->client; }
  /// The client's number for it; several endpoints of one client on one pipe have different ones.
  std::int32_t index() const { return state_->index; }
  bool is_open() const { return state_->sender != nullptr; }

  /// Packets arrive in the order of sending, none is left out.
  /// Errors   invalid_operation: closed; out_of_system_resource: the client reads too slowly, nothing was sent (wait
  ///          until queued_bytes() is small); those of packing.
  [[nodiscard]] Result<> send(const Value& value) const;
  /// The client is told. No on_close follows.
  void close() const;

  /// Bytes that wait for this client's stream, of all members.
  std::size_t queued_bytes() const { return is_open() ? state_->sender->queued_bytes() : 0; }
  /// Broadcast packets that the client has not acknowledged yet.
  std::size_t backlog() const { return state_->unacknowledged.size(); }
  /// Broadcast packets that were not sent because it lagged behind.
  std::uint64_t missed() const { return state_->missed; }

  bool operator==(const PipeEndpoint&) const = default;

 private:
  friend class Object;
  friend class ServiceClient;

  struct State {
    PipeSender* sender = nullptr;  ///< null: closed
    PipeId id = 0;
    ClientId client = 0;
    std::shared_ptr<ServiceObject> object;
    const MemberDefinition* member = nullptr;
    std::int32_t index = 0;
    std::vector<std::uint32_t> unacknowledged;
    std::uint64_t missed = 0;
  };
  explicit PipeEndpoint(State state) : state_(std::make_shared<State>(std::move(state))) {}

  /// Returns whether it was sent.
  bool broadcast(SharedPipePacket& packet, std::int32_t max_backlog) const;
  void acknowledge(std::span<const std::uint32_t> numbers) const;

  std::shared_ptr<State> state_;
};

/// Errors   those of Value::to...: the packet does not fit the handler's type.
using PacketHandler = std::function<Result<>(const PipeEndpoint&, const Value&)>;

namespace detail {

template <class F>
struct PacketSignature : PacketSignature<decltype(&F::operator())> {};
template <class C, class Endpoint, class Packet>
struct PacketSignature<void (C::*)(Endpoint, Packet) const> {
  using Type = std::remove_cvref_t<Packet>;
};
template <class C, class Endpoint, class Packet>
struct PacketSignature<void (C::*)(Endpoint, Packet)> {
  using Type = std::remove_cvref_t<Packet>;
};
/// The type of the second parameter of a callable whose operator() is not overloaded.
template <class F>
using PacketOf = typename PacketSignature<F>::Type;

template <class Packet, class F>
PacketHandler make_packet_handler(F handler) {
  return [handler = std::move(handler)](const PipeEndpoint& endpoint, const Value& value) mutable -> Result<> {
    auto packet = from_value<Packet>(value);
    if (!packet) return packet.error();
    handler(endpoint, std::move(*packet));
    return {};
  };
}

}  // namespace detail

}  // namespace rr
