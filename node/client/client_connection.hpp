// A client of one service, with callbacks. Layer: node/client.
#pragma once

#include <boost/asio/any_io_executor.hpp>
#include <boost/asio/cancellation_signal.hpp>
#include <boost/asio/io_context.hpp>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <tuple>
#include <unordered_map>
#include <vector>

#include "core/session/client/client_session.hpp"
#include "core/support/spare_node.hpp"
#include "node/driver/stream_driver.hpp"
#include "node/transport/dial.hpp"

namespace rr {

class ClientConnection;

/// How to reach a service and what to be there.
struct ConnectOptions : ClientOptions {
  ConnectOptions() = default;
  ConnectOptions(ClientOptions options) : ClientOptions(std::move(options)) {}

  DialOptions dial = {};  ///< its timeout is connect_timeout
  /// More URLs of the same service: all are dialed side by side, and the first that is reached is used.
  std::vector<std::string> other_urls = {};
  /// None: as the reference on the transport (heartbeat_of()). What `connection` says of it is not used.
  std::optional<Heartbeat> heartbeat = {};
  /// A sentence about a handler that threw; the connection goes on. The default writes it to stderr.
  std::function<void(const std::string& problem)> report = {};
};

/// A connection that is being opened.
class ClientOpening {
 public:
  explicit ClientOpening(boost::asio::any_io_executor executor) : executor_(std::move(executor)) {}
  /// Gives it up: sockets are closed and nobody is told. Nothing happens once it is open or has failed.
  void cancel();
  bool is_over() const { return is_over_; }
  /// For ClientConnection::open().
  void begin_session(const std::shared_ptr<ClientConnection>& connection) { connection_ = connection; }

 private:
  friend class ClientConnection;
  const boost::asio::any_io_executor executor_;
  const std::shared_ptr<boost::asio::cancellation_signal> dialing_ =
      std::make_shared<boost::asio::cancellation_signal>();
  std::weak_ptr<ClientConnection> connection_;  ///< while the session is being opened
  bool is_over_ = false;
};

/// A handler that was added to others: a handle that is cheap to copy. Forgetting it changes nothing.
class HandlerRegistration {
 public:
  HandlerRegistration() = default;  ///< of nothing
  /// Takes the handler out, also from within it: it is not called any more. Once: more often does nothing.
  void remove() const;

 private:
  friend class ClientConnection;
  std::weak_ptr<ClientConnection> connection_;
  std::shared_ptr<bool> is_removed_;
};

/// One connection to a service. All callbacks run on the thread of the io_context; one that throws is
/// reported (ConnectOptions::report), and the connection goes on. Each completion is called exactly once, when the
/// reply is there or the connection has ended; for a request that cannot be sent, maybe before the function returns.
class ClientConnection final : public SessionDriver<ClientSession> {
 public:
  using Opened = std::function<void(Result<std::shared_ptr<ClientConnection>>)>;
  using Completion = std::function<void(Result<Value>)>;
  using EventHandler = std::function<void(std::span<const Value> arguments)>;
  using WireHandler = std::function<void(const Value& value, TimeSpec time)>;
  using CallbackHandler = std::function<Result<Value>(std::span<const Value> arguments)>;
  /// For on_callback_later().
  using CallbackReply = std::function<void(const Result<Value>& answer)>;
  using LateCallbackHandler = std::function<void(std::span<const Value> arguments, CallbackReply reply)>;
  struct PipeHandlers {
    std::function<void(Value packet)> received;
    std::function<void()> closed = {};  ///< by the service; not for disconnect_pipe() and the session's end
    /// Packets of send_pipe_for_ack() have arrived.
    std::function<void(std::span<const std::uint32_t> numbers)> acknowledged = {};
  };

  /// Resolves, connects (all addresses, side by side) and opens the session, all within options.connect_timeout.
  /// `url`      SCHEME://host:port/?service=NAME, with nodeid or nodename where that node alone will do; the schemes
  ///            are those of node/transport/dial.cpp.
  /// `options`  service and target node are taken from the URL; a random NodeID where none is given.
  /// Returns    what can give it up; it goes on without it as well.
  static std::shared_ptr<ClientOpening> open(boost::asio::io_context& io, std::string_view url, ConnectOptions options,
                                             Opened done);
  /// Opens the session on a stream to the node, within options.connect_timeout.
  static void open(std::unique_ptr<ByteStream> stream, ConnectOptions options, Opened done);

  // Paths name objects: root_path(), or those of child_path() after find_object(). See ClientSession for what requests
  // complete with.
  const std::string& root_path() const { return session_.service(); }
  void call(std::string_view path, std::string_view function, std::span<const Value> arguments, Completion done);
  /// Completes with the generator's index, for the others; next with the error stop_iteration after the last value.
  RequestId open_generator(std::string_view path, std::string_view function, std::span<const Value> arguments,
                           Completion done);
  void next_generator(std::string_view path, std::string_view function, std::int32_t index,
                      const std::optional<Value>& parameter, Completion done);
  void close_generator(std::string_view path, std::string_view function, std::int32_t index, Completion done);
  void abort_generator(std::string_view path, std::string_view function, std::int32_t index, Completion done);
  void get_memory_dimensions(std::string_view path, std::string_view memory, Completion done);
  void read_memory(std::string_view path, std::string_view memory, const MemoryRange& range, Completion done);
  void write_memory(std::string_view path, std::string_view memory, std::span<const std::uint64_t> position,
                    const Value& value, Completion done);
  void get(std::string_view path, std::string_view property, Completion done);
  void set(std::string_view path, std::string_view property, const Value& value, Completion done);
  void find_object(std::string_view path, Completion done);
  void peek_in(std::string_view path, std::string_view wire, Completion done);
  void peek_out(std::string_view path, std::string_view wire, Completion done);
  void poke_out(std::string_view path, std::string_view wire, const Value& value, Completion done);
  /// `handler` gets each InValue that is newer than the one before, until disconnect_wire(). One handler a wire.
  RequestId connect_wire(std::string_view path, std::string_view wire, WireHandler handler, Completion done);
  /// Disconnects the wire unless connect_wire() has been called for it since the call that returned `connect`.
  void end_wire(std::string_view path, std::string_view wire, RequestId connect);
  void disconnect_wire(std::string_view path, std::string_view wire, Completion done);
  /// `handler` hears that the service has closed the wire, or released its object; not of disconnect_wire() and the
  /// session's end. One handler a wire.
  void on_wire_closed(std::string_view path, std::string_view wire, std::function<void()> handler);
  /// Errors   the wire is not connected; those of packing.
  Result<> send_wire(std::string_view path, std::string_view wire, const Value& value);
  /// Drops a value that send_wire() keeps because much waits for the stream.
  void drop_waiting_value(std::string_view path, std::string_view wire) { session_.drop_waiting_value(path, wire); }
  /// Completes with the index of the endpoint, which may be another than the one asked for. Packets follow.
  RequestId connect_pipe(std::string_view path, std::string_view pipe, std::int32_t index, PipeHandlers handlers,
                         Completion done);
  void disconnect_pipe(std::string_view path, std::string_view pipe, std::int32_t index, Completion done);
  /// Errors   the endpoint is not connected; out_of_system_resource: too much waits for the stream, nothing was sent
  ///          (see ClientSession::queued_bytes()); those of packing.
  Result<> send_pipe(std::string_view path, std::string_view pipe, std::int32_t index, const Value& packet);
  /// The same, and returns the packet's number, which PipeHandlers::acknowledged names once it has arrived.
  Result<std::uint32_t> send_pipe_for_ack(std::string_view path, std::string_view pipe, std::int32_t index,
                                          const Value& packet);
  /// See ClientSession.
  void hold_pipe_acks(std::string_view path, std::string_view pipe, std::int32_t index, bool is_held);
  /// Completes a request with operation_cancelled at once; see ClientSession. Unknown ids, and those of requests that
  /// are answered, are ignored.
  void cancel(RequestId id);
  // Session operations; see ClientSession.
  void authenticate(std::string_view username, const Value& credentials, Completion done);
  void logout(Completion done);
  /// As they are now, and losses of this connection's subscriptions: see read_losses() in subscription_losses.hpp.
  void get_attributes(Completion done);
  /// See ClientSession::lease().
  void lease(std::string_view path, LeaseCommand command, std::chrono::milliseconds deadman, Completion done);
  /// See ClientSession::set_urgent().
  void set_urgent(bool is_urgent) { session_.set_urgent(is_urgent); }
  RequestId lock(std::string_view path, LockKind kind, Completion done);
  void unlock(std::string_view path, Completion done);
  RequestId enter_monitor(std::string_view path, std::chrono::milliseconds timeout, Completion done);
  void exit_monitor(std::string_view path, Completion done);
  /// What the service gets when it calls: a value, null for void callbacks, or an error; an exception reaches it as
  /// one. One handler a callback; a second replaces the first.
  void on_callback(std::string_view path, std::string_view callback, CallbackHandler handler);
  /// As on_callback(), where the answer takes its time: `reply` is called once, on the thread of the io_context, also
  /// when the connection has ended. The service waits as long as it wants to.
  void on_callback_later(std::string_view path, std::string_view callback, LateCallbackHandler handler);
  /// One handler beside those that the event has already; they are called in the order of coming.
  /// `is_removed`  becomes true when the handler is taken out, for who wants to know.
  HandlerRegistration add_event_handler(std::string_view path, std::string_view event, EventHandler handler,
                                        std::shared_ptr<bool> is_removed = std::make_shared<bool>(false));
  /// Instead of all handlers that the event has.
  void on_event(std::string_view path, std::string_view event, EventHandler handler);
  /// In a catch block: reports what a handler has thrown.
  void handler_failed(std::string_view kind, std::string_view name) const;
  /// `handler` hears that the service has replaced the objects at and below a path; its other handlers there are gone.
  void on_path_released(std::function<void(const std::string& path)> handler);
  /// Called once, when the session has ended for whatever reason, or soon where it has ended already; not after a
  /// failed open(). Each handler that is given.
  void on_closed(std::function<void(const Error& reason)> handler);
  /// Tells the service, then closes; on_closed follows.
  void disconnect();

  const ClientSession& session() const { return session_; }

  /// For open(): use that.
  ClientConnection(std::unique_ptr<ByteStream> stream, ConnectOptions options, Opened opened);

 private:
  friend class HandlerRegistration;
  using MemberKey = std::pair<std::string, std::string>;               // path, member
  using PipeKey = std::tuple<std::string, std::string, std::int32_t>;  // path, member, index

  bool handle_event(Now now) override;
  void ended() override {}

  void handle(Connected&& connected);
  void handle(Completed&& completed);
  void handle(EventReceived&& received);
  void handle(WireValueReceived&& received);
  void handle(WireClosedByService&& closed);
  void handle(PipePacketReceived&& received);
  void handle(PipePacketsAcknowledged&& acknowledged);
  void handle(PipeClosedByService&& closed);
  void handle(CallbackCalled&& called);
  void handle(PathReleased&& released);
  void handle(SessionClosed&& closed);
  /// Asks the session by `ask(now)`, whose request completes with `done`. Returns the request.
  template <class Ask>
  RequestId expect(Ask&& ask, Completion done);
  /// Runs a handler; what it throws is reported.
  template <class F>
  void run_handler(std::string_view kind, std::string_view name, F&& handler);
  void report(const std::string& problem) const;

  std::function<void(const std::string&)> report_;
  Opened opened_;
  using Completions = std::unordered_map<RequestId, Completion>;
  Completions completions_;
  SpareNode<Completions> spare_completion_;
  struct EventSubscription {
    EventHandler handler;
    std::shared_ptr<bool> is_removed;
  };
  struct WireSubscription {
    WireHandler handler;
    RequestId connect = 0;  ///< 0 until the request is made
  };
  void forget_wire(const MemberKey& key, const WireSubscription& wire);

  // None of these is kept once the session has ended: it might be what keeps this connection.
  std::multimap<MemberKey, std::shared_ptr<EventSubscription>> event_handlers_;
  std::map<MemberKey, std::shared_ptr<WireSubscription>> wire_handlers_;
  std::map<MemberKey, std::function<void()>> wire_closed_handlers_;
  std::map<MemberKey, std::shared_ptr<LateCallbackHandler>> callback_handlers_;
  std::function<void(const std::string& path)> path_released_;
  std::map<PipeKey, std::shared_ptr<PipeHandlers>> pipe_handlers_;
  std::vector<std::function<void(const Error&)>> on_closed_;
  std::optional<Error> end_;  ///< why the session has ended
};

}  // namespace rr
