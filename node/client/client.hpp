// A client that waits: for tests, tools and scripts in C++. Layer: node/client.
//
//   auto create = rr::connect("rr+tcp://127.0.0.1:52222/?service=Create");
//   create.call("Drive", 100, 5000);
//   std::cout << *create.get("DistanceTraveled").to<std::int32_t>() << " mm\n";
//   create.on_event("Bump", [&](std::span<const rr::Value>) { create.call("Drive", 0, 0); });
//   create.connection().run_for(std::chrono::seconds(5));
#pragma once

#include <array>
#include <chrono>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>

#include "node/client/client_connection.hpp"
#include "node/client/remote_generator.hpp"
#include "node/client/remote_memory.hpp"
#include "node/values/exception.hpp"
#include "node/values/handler.hpp"

namespace rr {

/// A request that failed, or a connection that could not be opened.
class ClientException : public Exception {
 public:
  using Exception::Exception;
};

/// A connection and the io_context that it runs on, which runs only while one of the functions here waits: handlers of
/// events, wires, pipes and callbacks are called then, on the thread that waits, one after another in the order of what
/// they tell of. A handler may make requests and wait for them; the others are called when it has returned. What waits
/// for handlers that take too long: of a wire the newest value, of the rest up to 65,536 calls and 64 MiB, above which
/// the connection is closed. Nor are heartbeats answered in between: a service takes who waits here, or calls
/// run_for(0ms), for less than once in 20 s for gone, and ends its locks. For one thread.
class BlockingConnection {
 public:
  /// Throws   ClientException.
  BlockingConnection(std::string_view url, ConnectOptions options);
  /// Disconnects, within a second.
  ~BlockingConnection();
  BlockingConnection(const BlockingConnection&) = delete;
  BlockingConnection& operator=(const BlockingConnection&) = delete;

  /// Calls handlers for a time, or until `is_done()`. Returns whether it is done. A handler that runs at the end of the
  /// time is waited for; those behind it are called by whoever waits next.
  void run_for(std::chrono::milliseconds duration);
  bool run_until(const std::function<bool()>& is_done, std::chrono::milliseconds timeout);
  /// Starts a request and waits for its completion. Throws ClientException.
  template <class Start>
  Value wait_for(const Start& start) {
    return wait_for_completion(std::ref(start));  // a function that refers to what it calls allocates nothing
  }
  /// Logs in to a service that does not require it, or in as another user. Throws ClientException.
  void authenticate(std::string_view username, std::string_view password);
  void logout();
  /// What the service says of itself.
  const MapString& attributes() const { return connection_->session().attributes(); }
  void close();
  bool is_closed() const { return close_reason_.has_value(); }
  /// Handlers that are given to it are called where nothing can wait (std::logic_error).
  ClientConnection& asynchronous() { return *connection_; }

 private:
  friend class RemoteObject;
  struct HandlerCall {
    const char* kind;
    std::string name;
    std::function<void()> call;
    std::size_t bytes = 0;  ///< of the values that it holds; not of a wire's, of which there is one
  };

  Value wait_for_completion(const std::function<void(ClientConnection&, ClientConnection::Completion)>& start);
  /// Has a handler called by whoever waits here.
  void queue(HandlerCall handler);
  /// Calls those that wait now, but none after `until`, except for the first. What comes while they run, which handlers
  /// that wait themselves let in, is for the next time: it might never end.
  void run_handlers(std::chrono::steady_clock::time_point until = std::chrono::steady_clock::time_point::max());
  bool has_handlers() const { return !handlers_.empty() && !is_handling_; }
  /// Handles what comes next. Returns whether there was anything before `until`.
  bool serve(std::optional<std::chrono::steady_clock::time_point> until);

  boost::asio::io_context io_{1};
  std::shared_ptr<ClientConnection> connection_;
  std::optional<Error> close_reason_;
  std::deque<HandlerCall> handlers_;
  std::size_t waiting_bytes_ = 0;  ///< of handlers_
  bool is_handling_ = false;       ///< one of them runs
  bool is_serving_ = false;
  /// For each connected wire, whether it was disconnected since.
  std::map<std::pair<std::string, std::string>, std::shared_ptr<bool>> wires_;
};

/// Holds the monitor lock of an object for as long as it lives.
class MonitorGuard {
 public:
  MonitorGuard(std::shared_ptr<BlockingConnection> connection, std::string path)
      : connection_(std::move(connection)), path_(std::move(path)) {}
  MonitorGuard(MonitorGuard&& other) noexcept = default;
  MonitorGuard& operator=(MonitorGuard&&) = delete;
  /// Gives the lock back without waiting for the answer.
  ~MonitorGuard();
  /// Gives it back now, and waits. Throws ClientException: it was lost meanwhile.
  void exit();

 private:
  std::shared_ptr<BlockingConnection> connection_;  ///< null once the lock is given back
  std::string path_;
};

/// An endpoint of a pipe: a handle that is cheap to copy. Everything throws ClientException.
class RemotePipe {
 public:
  /// Waits while the stream is full, as long as a request may take.
  void send(const Value& packet) const;
  void close() const;
  std::int32_t index() const { return state_->index; }
  bool is_open() const { return state_->is_open && !connection_->is_closed(); }

 private:
  friend class RemoteObject;
  struct State {
    std::int32_t index = 0;
    bool is_open = true;
    bool is_closed_here = false;  ///< packets that came before are dropped
  };
  RemotePipe(std::shared_ptr<BlockingConnection> connection, std::string path, std::string pipe)
      : connection_(std::move(connection)), path_(std::move(path)), pipe_(std::move(pipe)) {}

  std::shared_ptr<BlockingConnection> connection_;
  std::string path_;
  std::string pipe_;
  std::shared_ptr<State> state_ = std::make_shared<State>();
};

/// An object of the service: a handle that is cheap to copy. Everything throws ClientException.
class RemoteObject {
 public:
  RemoteObject(std::shared_ptr<BlockingConnection> connection, std::string path)
      : connection_(std::move(connection)), path_(std::move(path)) {}

  template <class... Args>
  Value call(std::string_view function, Args&&... arguments) const {
    const std::array<Value, sizeof...(Args)> values{to_value(std::forward<Args>(arguments))...};
    return call_values(function, values);
  }
  Value call_values(std::string_view function, std::span<const Value> arguments) const;
  /// Calls a generator function.
  template <class... Args>
  RemoteGenerator generator(std::string_view function, Args&&... arguments) const {
    const std::array<Value, sizeof...(Args)> values{to_value(std::forward<Args>(arguments))...};
    return generator_values(function, values);
  }
  RemoteGenerator generator_values(std::string_view function, std::span<const Value> arguments) const;
  RemoteMemory memory(std::string_view name) const { return {connection_, path_, std::string(name)}; }
  Value get(std::string_view property) const;
  void set(std::string_view property, const Value& value) const;
  RemoteObject object(std::string_view objref) const;
  RemoteObject object(std::string_view objref, std::string_view index) const;

  Value peek_in(std::string_view wire) const;
  Value peek_out(std::string_view wire) const;
  void poke_out(std::string_view wire, const Value& value) const;
  void connect_wire(std::string_view wire, ClientConnection::WireHandler handler) const;
  void disconnect_wire(std::string_view wire) const;
  void send_wire(std::string_view wire, const Value& value) const;
  /// `received` gets every packet, in order, until the endpoint is closed.
  RemotePipe connect_pipe(std::string_view pipe, std::function<void(Value packet)> received,
                          std::int32_t index = any_pipe_index) const;
  /// handler of the callback's C++ types, or Value; returns the answer. What it throws, the service gets as an error.
  template <class F>
  void on_callback(std::string_view callback, F&& handler) const {
    on_callback_values(callback, make_plain_handler(std::forward<F>(handler)).call);
  }
  void on_callback_values(std::string_view callback, ClientConnection::CallbackHandler handler) const;
  /// One handler more; all are called.
  HandlerRegistration on_event(std::string_view event, ClientConnection::EventHandler handler) const;

  /// Keeps others out of this object and all below it, until unlock() or until this client has gone.
  void lock(LockKind kind = LockKind::user) const;
  void unlock() const;
  /// Waits for the monitor lock. `timeout` negative: for ever.
  [[nodiscard]] MonitorGuard enter_monitor(std::chrono::milliseconds timeout = std::chrono::milliseconds(-1)) const;

  /// Qualified.
  const std::string& type_name() const;
  const std::string& path() const { return path_; }
  BlockingConnection& connection() const { return *connection_; }

 private:
  std::shared_ptr<BlockingConnection> connection_;
  std::string path_;
};

/// The root object of the service that `url` names. A service that requires a user takes options.username and
/// options.credentials, or those given here.
RemoteObject connect(std::string_view url, ConnectOptions options = {});
RemoteObject connect(std::string_view url, std::string_view username, std::string_view password,
                     ConnectOptions options = {});

}  // namespace rr
