// Objects of a service as generated classes for programs on Asio see them. Layer: node/client.
//
//   const auto object = co_await rr::async_connect(io, "rr+tcp://127.0.0.1:52222/?service=Create");
//   const experimental::create2::CreateAsyncClient create(object);
//   co_await create.Drive(100, 5000);
//   std::cout << co_await create.DistanceTraveled().get() << " mm\n";
//   create.Bump().on([] { std::cout << "bump\n"; });
//
// What is not waited for throws at once. What is takes a completion token as its last argument, as AsyncObject does,
// and fails with the exceptions that the definition declares as their classes, or rr::ClientException; rr::Exception is
// the base of both. GCC 12: values in braces get a name before they are handed to something that is awaited.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "node/client/async_object.hpp"
#include "node/client/typed_handler.hpp"

namespace rr {

/// The default token: co_await.
using UseAwaitable = boost::asio::use_awaitable_t<>;

template <class T, class Parameter>
class AsyncGenerator;

namespace detail {

template <class T>
struct CompletionOf {
  using Signature = void(std::exception_ptr, T);
};
template <>
struct CompletionOf<void> {
  using Signature = void(std::exception_ptr);
};

template <class... Args>
std::vector<Value> pack_arguments(const Args&... arguments) {
  std::vector<Value> values;
  values.reserve(sizeof...(Args));
  (values.push_back(pack_value(arguments)), ...);
  return values;
}

}  // namespace detail

/// Base of generated clients: a handle that is cheap to copy. Members of the definition never begin with rr.
class AsyncClientStub {
 public:
  AsyncClientStub() = default;  ///< no object

  /// The object without types.
  AsyncObject rr_object;

  /// For handles of members: `start(connection, path, completion)` begins a request, `convert` makes a T of what it
  /// completes with: a Value, or the Result<Value> where it takes that.
  template <class T, class Token, class Start, class Convert>
  auto rr_request(Token& token, Start start, Convert convert) const {
    return boost::asio::async_initiate<Token, typename detail::CompletionOf<T>::Signature>(
        [object = rr_object, throw_declared = throw_declared_, start = std::move(start),
         convert = std::move(convert)](auto handler) mutable {
          using Complete = detail::CompleteOnce<T, decltype(handler)>;
          const Complete complete(std::move(handler), object.connection()->executor());
          auto completed = [complete, throw_declared, convert = std::move(convert)](Result<Value> result) {
            const auto value = [&]() -> T {
              if constexpr (std::is_invocable_v<Convert, Result<Value>>) {
                return convert(std::move(result));
              } else {
                if (!result) {
                  throw_declared(result.error());
                  throw ClientException(result.error());
                }
                return convert(std::move(*result));
              }
            };
            finish<T>(complete, value);
          };
          detail::start_request(complete, object.connection(),
                                [&] { return start(*object.connection(), object.path(), std::move(completed)); });
        },
        token);
  }
  ThrowDeclared rr_thrower() const { return throw_declared_; }

 protected:
  /// Throws   ClientException: the object is neither of type `type` nor implements it.
  AsyncClientStub(AsyncObject object, std::string_view type, ThrowDeclared throw_declared);

  template <class R, class Token, class... Args>
  auto rr_call(const char* function, Token& token, const Args&... arguments) const {
    return rr_request<R>(
        token,
        [function, values = detail::pack_arguments(arguments...)](ClientConnection& connection, const std::string& path,
                                                                  ClientConnection::Completion done) {
          connection.call(path, function, values, std::move(done));
        },
        [](const Value& value) { return unpack_value<R>(value); });
  }
  template <class T, class Parameter, class Token, class... Args>
  auto rr_generator(const char* function, Token& token, const Args&... arguments) const {
    return rr_request<AsyncGenerator<T, Parameter>>(
        token,
        [function, values = detail::pack_arguments(arguments...)](ClientConnection& connection, const std::string& path,
                                                                  ClientConnection::Completion done) {
          return connection.open_generator(path, function, values, std::move(done));
        },
        [client = *this, function](const Value& index) {
          return AsyncGenerator<T, Parameter>(client, function, index.to<std::int32_t>().value());
        });
  }
  template <class Client, class Token, class... Index>
  auto rr_child(const char* objref, Token& token, const Index&... index) const {
    return rr_request<Client>(
        token,
        [child = child_path(rr_object.path(), objref, index...)](ClientConnection& connection, const std::string&,
                                                                 ClientConnection::Completion done) {
          connection.find_object(child, std::move(done));
        },
        [child = AsyncObject(rr_object.connection(), child_path(rr_object.path(), objref, index...))](const Value&) {
          return Client(child);
        });
  }

 private:
  template <class T, class Complete, class F>
  static void finish(const Complete& complete, const F& value) {
    std::exception_ptr failure;
    if constexpr (std::is_void_v<T>) {
      try {
        value();
      } catch (...) {
        failure = std::current_exception();
      }
      complete.finish(std::move(failure));
    } else {
      std::optional<T> made;
      try {
        made.emplace(value());
      } catch (...) {
        failure = std::current_exception();
      }
      complete.finish(std::move(failure), made ? std::move(*made) : T{});
    }
  }

  ThrowDeclared throw_declared_ = nullptr;
};

/// What handles of members have in common: valid as long as the connection, whatever becomes of the client object.
class AsyncMember {
 public:
  /// `name`  outlives the handle: a literal.
  AsyncMember(const AsyncClientStub& client, const char* name) : client_(client), name_(name) {}
  const char* name() const { return name_; }

 protected:
  const AsyncObject& object() const { return client_.rr_object; }
  const AsyncClientStub& client() const { return client_; }
  /// Begins `Request(path, name, arguments..., completion)` when the token is launched.
  template <auto Request, class T, class Token, class... Args>
  auto ask(Token& token, Args... arguments) const {
    return client_.rr_request<T>(
        token,
        [name = name_, ... rest = std::move(arguments)](ClientConnection& connection, const std::string& path,
                                                        ClientConnection::Completion done) mutable {
          (connection.*Request)(path, name, std::move(rest)..., std::move(done));
        },
        [](const Value& value) { return unpack_value<T>(value); });
  }

 private:
  AsyncClientStub client_;
  const char* name_;
};

template <class T, MemberDirection direction = MemberDirection::both>
class AsyncProperty : public AsyncMember {
 public:
  using AsyncMember::AsyncMember;
  template <class Token = UseAwaitable>
  auto get(Token&& token = {}) const requires(direction != MemberDirection::writeonly) {
    return ask<&ClientConnection::get, T>(token);
  }
  template <class Token = UseAwaitable>
  auto set(const T& value, Token&& token = {}) const requires(direction != MemberDirection::readonly) {
    return ask<&ClientConnection::set, void>(token, pack_value<T>(value));
  }
};

/// InValues come from the service, OutValues go to it.
template <class T, MemberDirection direction = MemberDirection::both>
class AsyncWire : public AsyncMember {
 public:
  using AsyncMember::AsyncMember;
  using Type = T;
  /// handler(T) or handler(T, rr::TimeSpec) gets each InValue that is newer than the one before.
  template <class F, class Token = UseAwaitable>
  requires(std::is_invocable_v<F&, T> || std::is_invocable_v<F&, T, TimeSpec>) auto connect(F handler,
                                                                                            Token&& token = {}) const
      requires(direction != MemberDirection::writeonly) {
    return connect_with(token, detail::typed_wire_handler<T>(std::move(handler)));
  }
  /// To send alone.
  template <class Token = UseAwaitable>
  auto connect_to_send(Token&& token = {}) const requires(direction != MemberDirection::readonly) {
    return connect_with(token, nullptr);
  }
  template <class Token = UseAwaitable>
  auto disconnect(Token&& token = {}) const {
    return ask<&ClientConnection::disconnect_wire, void>(token);
  }
  /// On a connected wire, at once.
  void send(const T& value) const requires(direction != MemberDirection::readonly) {
    if (const auto sent = object().send_wire(name(), pack_value<T>(value)); !sent) throw ClientException(sent.error());
  }
  template <class Token = UseAwaitable>
  auto peek(Token&& token = {}) const requires(direction != MemberDirection::writeonly) {
    return ask<&ClientConnection::peek_in, T>(token);
  }
  template <class Token = UseAwaitable>
  auto peek_out(Token&& token = {}) const requires(direction != MemberDirection::readonly) {
    return ask<&ClientConnection::peek_out, T>(token);
  }
  template <class Token = UseAwaitable>
  auto poke(const T& value, Token&& token = {}) const requires(direction != MemberDirection::readonly) {
    return ask<&ClientConnection::poke_out, void>(token, pack_value<T>(value));
  }

 private:
  template <class Token>
  auto connect_with(Token& token, ClientConnection::WireHandler handler) const {
    return client().template rr_request<void>(
        token,
        [name = name(), handler = std::move(handler)](ClientConnection& connection, const std::string& path,
                                                      ClientConnection::Completion done) mutable {
          return connection.connect_wire(path, name, std::move(handler), std::move(done));
        },
        [](const Value&) {});
  }
};

template <class... Args>
class AsyncEvent : public AsyncMember {
 public:
  using AsyncMember::AsyncMember;
  /// handler(Args...), one more; all are called.
  template <class F>
  HandlerRegistration on(F handler) const {
    return object().on_event(name(), detail::typed_event_handler<Args...>(std::move(handler)));
  }
};

/// One endpoint of a pipe, for as long as it is open: a handle that is cheap to copy.
template <class T, MemberDirection direction = MemberDirection::both>
class AsyncPipeEndpoint {
 public:
  AsyncPipeEndpoint() = default;  ///< of no pipe
  AsyncPipeEndpoint(AsyncObject object, const char* pipe, std::int32_t index, std::shared_ptr<bool> is_open)
      : object_(std::move(object)), pipe_(pipe), index_(index), is_open_(std::move(is_open)) {}

  /// At once. Throws ClientException out_of_system_resource: the stream is full, nothing was sent.
  void send(const T& packet) const requires(direction != MemberDirection::readonly) {
    if (const auto sent = object_.send_pipe(pipe_, index_, pack_value<T>(packet)); !sent)
      throw ClientException(sent.error());
  }
  template <class Token = UseAwaitable>
  auto close(Token&& token = {}) const {
    *is_open_ = false;
    return object_.disconnect_pipe(pipe_, index_, std::forward<Token>(token));
  }
  std::int32_t index() const { return index_; }
  bool is_open() const { return is_open_ && *is_open_ && !object_.connection()->is_closed(); }

 private:
  AsyncObject object_;
  const char* pipe_ = "";
  std::int32_t index_ = 0;
  std::shared_ptr<bool> is_open_;
};

template <class T, MemberDirection direction = MemberDirection::both>
class AsyncPipe : public AsyncMember {
 public:
  using AsyncMember::AsyncMember;
  using Type = T;
  using Endpoint = AsyncPipeEndpoint<T, direction>;
  /// handler(T) gets every packet, in order. Completes with an Endpoint.
  template <class F, class Token = UseAwaitable>
  requires std::is_invocable_v<F&, T>
  auto connect(F handler, Token&& token = {}) const requires(direction != MemberDirection::writeonly) {
    return open(token, [handler = std::move(handler)](Value packet) mutable { handler(unpack_value<T>(packet)); });
  }
  /// To send alone.
  template <class Token = UseAwaitable>
  auto connect_to_send(Token&& token = {}) const requires(direction != MemberDirection::readonly) {
    return open(token, nullptr);
  }

 private:
  template <class Token>
  auto open(Token& token, std::function<void(Value)> received) const {
    const auto is_open = std::make_shared<bool>(true);
    return client().template rr_request<Endpoint>(
        token,
        [name = name(), is_open, received = std::move(received)](ClientConnection& connection, const std::string& path,
                                                                 ClientConnection::Completion done) {
          ClientConnection::PipeHandlers handlers;
          handlers.received = received;
          handlers.closed = [is_open] { *is_open = false; };
          return connection.connect_pipe(path, name, any_pipe_index, std::move(handlers), std::move(done));
        },
        [object = object(), name = name(), is_open](const Value& index) {
          return Endpoint(object, name, index.to<std::int32_t>().value(), is_open);
        });
  }
};

/// What the service asks of this client.
template <class R, class... Args>
class AsyncCallback : public AsyncMember {
 public:
  using AsyncMember::AsyncMember;
  /// handler(Args...) returns an R. A second one replaces the first. What it throws, the service gets as an error.
  template <class F>
  void on(F handler) const {
    object().on_callback(name(), detail::typed_callback_handler<R, Args...>(std::move(handler)));
  }
};

/// Positions and counts have one number a dimension. A: std::vector or MultiDim of the items.
template <class A, MemberDirection direction = MemberDirection::both>
class AsyncMemory : public AsyncMember {
 public:
  using AsyncMember::AsyncMember;
  /// Completes with a MemoryShape.
  template <class Token = UseAwaitable>
  auto dimensions(Token&& token = {}) const {
    return ask<&ClientConnection::get_memory_dimensions, MemoryShape>(token);
  }
  template <class Token = UseAwaitable>
  auto read(const MemoryShape& position, const MemoryShape& count, Token&& token = {}) const
      requires(direction != MemberDirection::writeonly) {
    return ask<&ClientConnection::read_memory, A>(token, MemoryRange{position, count});
  }
  template <class Token = UseAwaitable>
  auto write(const MemoryShape& position, const A& items, Token&& token = {}) const
      requires(direction != MemberDirection::readonly) {
    return ask<&ClientConnection::write_memory, void>(token, position, pack_value<A>(items));
  }
};

/// A running generator: a handle that can be copied. T void: it returns nothing; Parameter void: it takes nothing. What
/// is not read to its end should be closed.
template <class T, class Parameter = void>
class AsyncGenerator {
 public:
  AsyncGenerator() = default;  ///< no generator
  AsyncGenerator(const AsyncClientStub& client, const char* function, std::int32_t index)
      : client_(client), function_(function), index_(index) {}

  /// Completes with the next value, std::nullopt after the last; of one that returns nothing, with whether it has not
  /// ended.
  template <class Token = UseAwaitable>
  auto next(Token&& token = {}) const requires std::is_void_v<Parameter> {
    return step(token, std::nullopt);
  }
  template <class Given, class Token = UseAwaitable>
  requires std::is_convertible_v<Given, Parameter>
  auto next(const Given& given, Token&& token = {}) const {
    return step(token, pack_value<Parameter>(Parameter(given)));
  }
  template <class Token = UseAwaitable>
  auto close(Token&& token = {}) const {
    return end<&ClientConnection::close_generator>(token);
  }
  template <class Token = UseAwaitable>
  auto abort(Token&& token = {}) const {
    return end<&ClientConnection::abort_generator>(token);
  }

 private:
  template <class Token>
  auto step(Token& token, std::optional<Value> parameter) const {
    using Next = decltype(convert(std::declval<Result<Value>>(), nullptr));
    return client_.rr_request<Next>(
        token,
        [function = function_, index = index_, parameter = std::move(parameter)](
            ClientConnection& connection, const std::string& path, ClientConnection::Completion done) {
          connection.next_generator(path, function, index, parameter, std::move(done));
        },
        [throw_declared = client_.rr_thrower()](Result<Value> result) {
          return convert(std::move(result), throw_declared);
        });
  }
  template <auto Request, class Token>
  auto end(Token& token) const {
    return client_.rr_request<void>(
        token,
        [function = function_, index = index_](ClientConnection& connection, const std::string& path,
                                               ClientConnection::Completion done) {
          (connection.*Request)(path, function, index, std::move(done));
        },
        [](const Value&) {});
  }
  static auto convert(Result<Value> result, ThrowDeclared throw_declared) {
    const bool has_ended = !result && result.error().code == ErrorCode::stop_iteration;
    if (!result && !has_ended) {
      throw_declared(result.error());
      throw ClientException(result.error());
    }
    if constexpr (std::is_void_v<T>)
      return !has_ended;
    else
      return has_ended ? std::nullopt : std::optional<T>(unpack_value<T>(*result));
  }

  AsyncClientStub client_;
  const char* function_ = "";
  std::int32_t index_ = 0;
};

}  // namespace rr
