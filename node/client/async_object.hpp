// A client for programs on Asio: every request takes a completion token. Layer: node/client.
//
//   asio::awaitable<void> drive(asio::io_context& io) {
//     auto create = co_await rr::async_connect(io, "rr+tcp://127.0.0.1:52222/?service=Create");
//     co_await create.call("Drive", 100, 5000);
//     std::cout << *(co_await create.get("DistanceTraveled")).to<std::int32_t>() << " mm\n";
//   }
//
// A token is asio::use_awaitable (the default), asio::use_future, a callback void(std::exception_ptr, Value), or any
// other of Asio's. What fails is a ClientException.
//
// Cancellation slots work (`co_await (arm.call("Home") || timer.async_wait(...))`): a request that is cancelled fails
// with operation_cancelled at once. The service is not told and goes on; what it answers then is dropped, and what was
// begun for the client (a wire, a pipe endpoint, a generator, a lock) is ended.
#pragma once

#include <boost/asio/any_io_executor.hpp>
#include <boost/asio/associated_cancellation_slot.hpp>
#include <boost/asio/associated_executor.hpp>
#include <boost/asio/async_result.hpp>
#include <boost/asio/dispatch.hpp>
#include <boost/asio/executor_work_guard.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/use_awaitable.hpp>
#include <exception>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/session/service_path.hpp"
#include "node/client/client.hpp"

namespace rr {

namespace detail {

/// Calls a completion handler once, on its own executor, with what a request came to: void(std::exception_ptr, T), or
/// without the T where that is void. Where its cancellation slot says so, with operation_cancelled.
template <class T, class Handler>
class CompleteOnce {
 public:
  /// `fallback` where the handler has no executor of its own.
  CompleteOnce(Handler handler, const boost::asio::any_io_executor& fallback) {
    auto slot = boost::asio::get_associated_cancellation_slot(handler);
    state_ = std::make_shared<State>(std::move(handler), fallback);
    if (!slot.is_connected()) return;
    slot.assign([weak = std::weak_ptr(state_)](boost::asio::cancellation_type type) {
      using Type = boost::asio::cancellation_type;
      const auto state = weak.lock();
      if (!state || (type & (Type::terminal | Type::partial)) == Type::none) return;
      // Posted: whoever completes may let go of the signal, which is being used.
      boost::asio::post(state->fallback, [weak] {
        if (const auto still_there = weak.lock()) CompleteOnce(still_there).cancel();
      });
    });
  }

  void operator()(Result<T> result) const {
    if (result)
      finish(nullptr, std::move(*result));
    else
      fail(result.error());
  }
  void fail(Error error) const {
    const auto failure = std::make_exception_ptr(ClientException(std::move(error)));
    if constexpr (std::is_void_v<T>)
      finish(failure);
    else
      finish(failure, T{});
  }
  /// `what` is done where the operation is cancelled.
  void on_cancelled(std::function<void()> what) const { state_->cancelled = std::move(what); }
  template <class... Results>
  void finish(std::exception_ptr failure, Results... results) const {
    if (!state_->handler) return;
    auto handler = std::move(*state_->handler);
    state_->handler.reset();
    const auto executor = boost::asio::get_associated_executor(handler, state_->fallback);
    boost::asio::dispatch(executor, [handler = std::move(handler), failure = std::move(failure),
                                     ... results = std::move(results)]() mutable {
      std::move(handler)(std::move(failure), std::move(results)...);
    });
  }

 private:
  struct State {
    State(Handler with, const boost::asio::any_io_executor& on)
        : handler(std::move(with)), fallback(on), work(boost::asio::make_work_guard(*handler, on)) {}
    std::optional<Handler> handler;
    boost::asio::any_io_executor fallback;
    std::function<void()> cancelled;
    boost::asio::executor_work_guard<boost::asio::associated_executor_t<Handler, boost::asio::any_io_executor>> work;
  };
  explicit CompleteOnce(std::shared_ptr<State> state) : state_(std::move(state)) {}
  void cancel() const {
    if (!state_->handler) return;
    if (state_->cancelled) state_->cancelled();
    fail(make_error(ErrorCode::operation_cancelled, "was cancelled"));
  }

  std::shared_ptr<State> state_;
};

/// Begins a request by `start()`. One that returns its id is cancelled with the operation: its session ends what the
/// service has begun for it.
template <class Complete, class Start>
void start_request(const Complete& complete, const std::shared_ptr<ClientConnection>& connection, Start&& start) {
  if constexpr (std::is_void_v<decltype(start())>) {
    start();
  } else {
    std::weak_ptr weak(connection);  // what completes at once may let go of whoever asked, and of `connection`
    const RequestId id = start();
    complete.on_cancelled([weak = std::move(weak), id] {
      if (const auto still_there = weak.lock()) still_there->cancel(id);
    });
  }
}

}  // namespace detail

/// An object of a service: a handle that is cheap to copy. For the thread of its io_context. What requests complete
/// with is told at ClientSession.
class AsyncObject {
 public:
  AsyncObject() = default;  ///< no object
  AsyncObject(std::shared_ptr<ClientConnection> connection, std::string path)
      : connection_(std::move(connection)), path_(std::move(path)) {}

  /// Arguments as they are; for another token than use_awaitable there is call_values().
  template <class... Args>
  boost::asio::awaitable<Value> call(std::string_view function, Args&&... arguments) const;
  template <class Token = boost::asio::use_awaitable_t<>>
  auto call_values(std::string_view function, std::vector<Value> arguments, Token&& token = {}) const {
    return request<&ClientConnection::call>(token, std::string(function), std::move(arguments));
  }
  template <class Token = boost::asio::use_awaitable_t<>>
  auto get(std::string_view property, Token&& token = {}) const {
    return request<&ClientConnection::get>(token, std::string(property));
  }
  template <class Token = boost::asio::use_awaitable_t<>>
  auto set(std::string_view property, Value value, Token&& token = {}) const {
    return request<&ClientConnection::set>(token, std::string(property), std::move(value));
  }

  /// The object behind an objref; `index` where it is indexed. Completes with an AsyncObject.
  template <class Token = boost::asio::use_awaitable_t<>>
  auto object(std::string_view objref, std::optional<std::string> index = std::nullopt, Token&& token = {}) const {
    const AsyncObject child(connection_, child_path(path_, objref, index));
    return boost::asio::async_initiate<Token, void(std::exception_ptr, AsyncObject)>(
        [child](auto handler) {
          const detail::CompleteOnce<AsyncObject, decltype(handler)> complete(std::move(handler),
                                                                              child.connection_->executor());
          child.connection_->find_object(child.path_, [complete, child](const Result<Value>& found) {
            complete(found ? Result<AsyncObject>(child) : Result<AsyncObject>(found.error()));
          });
        },
        token);
  }

  template <class Token = boost::asio::use_awaitable_t<>>
  auto peek_in(std::string_view wire, Token&& token = {}) const {
    return request<&ClientConnection::peek_in>(token, std::string(wire));
  }
  template <class Token = boost::asio::use_awaitable_t<>>
  auto peek_out(std::string_view wire, Token&& token = {}) const {
    return request<&ClientConnection::peek_out>(token, std::string(wire));
  }
  template <class Token = boost::asio::use_awaitable_t<>>
  auto poke_out(std::string_view wire, Value value, Token&& token = {}) const {
    return request<&ClientConnection::poke_out>(token, std::string(wire), std::move(value));
  }
  /// `received` gets each newer InValue until disconnect_wire().
  template <class Token = boost::asio::use_awaitable_t<>>
  auto connect_wire(std::string_view wire, ClientConnection::WireHandler received, Token&& token = {}) const {
    return request<&ClientConnection::connect_wire>(token, std::string(wire), std::move(received));
  }
  template <class Token = boost::asio::use_awaitable_t<>>
  auto disconnect_wire(std::string_view wire, Token&& token = {}) const {
    return request<&ClientConnection::disconnect_wire>(token, std::string(wire));
  }
  Result<> send_wire(std::string_view wire, const Value& value) const {
    return connection_->send_wire(path_, wire, value);
  }

  /// Completes with the endpoint's index as int32; packets follow in order.
  template <class Token = boost::asio::use_awaitable_t<>>
  auto connect_pipe(std::string_view pipe, ClientConnection::PipeHandlers handlers, std::int32_t index = any_pipe_index,
                    Token&& token = {}) const {
    return request<&ClientConnection::connect_pipe>(token, std::string(pipe), index, std::move(handlers));
  }
  template <class Token = boost::asio::use_awaitable_t<>>
  auto disconnect_pipe(std::string_view pipe, std::int32_t index, Token&& token = {}) const {
    return request<&ClientConnection::disconnect_pipe>(token, std::string(pipe), index);
  }
  Result<> send_pipe(std::string_view pipe, std::int32_t index, const Value& packet) const {
    return connection_->send_pipe(path_, pipe, index, packet);
  }

  /// Calls a generator function; completes with the generator's index as int32, which the three below take.
  template <class Token = boost::asio::use_awaitable_t<>>
  auto open_generator(std::string_view function, std::vector<Value> arguments = {}, Token&& token = {}) const {
    return request<&ClientConnection::open_generator>(token, std::string(function), std::move(arguments));
  }
  /// Completes with the next value; behind the last one a ClientException with stop_iteration.
  template <class Token = boost::asio::use_awaitable_t<>>
  auto next_generator(std::string_view function, std::int32_t index, std::optional<Value> parameter = {},
                      Token&& token = {}) const {
    return request<&ClientConnection::next_generator>(token, std::string(function), index, std::move(parameter));
  }
  template <class Token = boost::asio::use_awaitable_t<>>
  auto close_generator(std::string_view function, std::int32_t index, Token&& token = {}) const {
    return request<&ClientConnection::close_generator>(token, std::string(function), index);
  }
  template <class Token = boost::asio::use_awaitable_t<>>
  auto abort_generator(std::string_view function, std::int32_t index, Token&& token = {}) const {
    return request<&ClientConnection::abort_generator>(token, std::string(function), index);
  }

  /// Completes with a uint64 array: one number a dimension.
  template <class Token = boost::asio::use_awaitable_t<>>
  auto memory_dimensions(std::string_view memory, Token&& token = {}) const {
    return request<&ClientConnection::get_memory_dimensions>(token, std::string(memory));
  }
  /// Position and count in items, one number a dimension; completes with the items.
  template <class Token = boost::asio::use_awaitable_t<>>
  auto read_memory(std::string_view memory, MemoryShape position, MemoryShape count, Token&& token = {}) const {
    return request<&ClientConnection::read_memory>(token, std::string(memory),
                                                   MemoryRange{std::move(position), std::move(count)});
  }
  template <class Token = boost::asio::use_awaitable_t<>>
  auto write_memory(std::string_view memory, MemoryShape position, Value items, Token&& token = {}) const {
    return request<&ClientConnection::write_memory>(token, std::string(memory), std::move(position), std::move(items));
  }

  /// What the service gets when it calls this callback; see ClientConnection.
  void on_callback(std::string_view callback, ClientConnection::CallbackHandler handler) const {
    connection_->on_callback(path_, callback, std::move(handler));
  }
  /// One handler more; all are called.
  HandlerRegistration on_event(std::string_view event, ClientConnection::EventHandler handler) const {
    return connection_->add_event_handler(path_, event, std::move(handler));
  }

  /// Logs in; one login a connection.
  template <class Token = boost::asio::use_awaitable_t<>>
  auto authenticate(std::string_view username, Value credentials, Token&& token = {}) const {
    return boost::asio::async_initiate<Token, void(std::exception_ptr, Value)>(
        [connection = connection_, username = std::string(username),
         credentials = std::move(credentials)](auto handler) {
          const detail::CompleteOnce<Value, decltype(handler)> complete(std::move(handler), connection->executor());
          connection->authenticate(username, credentials, complete);
        },
        token);
  }
  template <class Token = boost::asio::use_awaitable_t<>>
  auto lock(LockKind kind = LockKind::user, Token&& token = {}) const {
    return request<&ClientConnection::lock>(token, kind);
  }
  template <class Token = boost::asio::use_awaitable_t<>>
  auto unlock(Token&& token = {}) const {
    return request<&ClientConnection::unlock>(token);
  }
  /// `timeout` negative: for ever.
  template <class Token = boost::asio::use_awaitable_t<>>
  auto enter_monitor(std::chrono::milliseconds timeout = std::chrono::milliseconds(-1), Token&& token = {}) const {
    return request<&ClientConnection::enter_monitor>(token, timeout);
  }
  template <class Token = boost::asio::use_awaitable_t<>>
  auto exit_monitor(Token&& token = {}) const {
    return request<&ClientConnection::exit_monitor>(token);
  }

  const std::string& path() const { return path_; }
  /// Null without an object.
  const std::shared_ptr<ClientConnection>& connection() const { return connection_; }

 private:
  // GCC 12 copies aggregates bitwise into coroutine frames, which breaks their strings (async_object_test.cpp crashes
  // then). So nothing here takes one by value, and what a request needs is captured, not handed to async_initiate.

  /// Begins `Request(path, arguments..., completion)` when the token is launched.
  template <auto Request, class Token, class... Args>
  auto request(Token& token, Args... arguments) const {
    return boost::asio::async_initiate<Token, void(std::exception_ptr, Value)>(
        [connection = connection_, path = path_, ... rest = std::move(arguments)](auto handler) mutable {
          const detail::CompleteOnce<Value, decltype(handler)> complete(std::move(handler), connection->executor());
          detail::start_request(complete, connection,
                                [&] { return ((*connection).*Request)(path, std::move(rest)..., complete); });
        },
        token);
  }

  std::shared_ptr<ClientConnection> connection_;
  std::string path_;
};

// Here, since clang wants to know what call_values() returns.
template <class... Args>
boost::asio::awaitable<Value> AsyncObject::call(std::string_view function, Args&&... arguments) const {
  std::vector<Value> values;
  values.reserve(sizeof...(Args));
  (values.push_back(to_value(std::forward<Args>(arguments))), ...);
  return call_values(function, std::move(values));
}

/// The root object of the service that `url` names; completes with an AsyncObject. The connection lives until
/// disconnect().
template <class Token = boost::asio::use_awaitable_t<>>
auto async_connect(boost::asio::io_context& io, std::string url, const ConnectOptions& options, Token&& token = {}) {
  return boost::asio::async_initiate<Token, void(std::exception_ptr, AsyncObject)>(
      [&io, url = std::move(url), options](auto handler) {
        const detail::CompleteOnce<AsyncObject, decltype(handler)> complete(std::move(handler), io.get_executor());
        const auto opening = ClientConnection::open(
            io, url, options, [complete](const Result<std::shared_ptr<ClientConnection>>& opened) {
              complete(opened ? Result<AsyncObject>(AsyncObject(*opened, (*opened)->root_path()))
                              : Result<AsyncObject>(opened.error()));
            });
        complete.on_cancelled([weak = std::weak_ptr(opening)] {
          if (const auto begun = weak.lock()) begun->cancel();
        });
      },
      token);
}
/// With default options.
template <class Token = boost::asio::use_awaitable_t<>>
auto async_connect(boost::asio::io_context& io, std::string url, Token&& token = {}) {
  const ConnectOptions options;
  return async_connect(io, std::move(url), options, std::forward<Token>(token));
}

}  // namespace rr
