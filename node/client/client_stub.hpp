// Objects of a service as generated classes see them: typed calls and handles of members. Layer: node/client.
//
//   experimental::create2::CreateClient create(rr::connect("rr+tcp://127.0.0.1:52222/?service=Create"));
//   create.Drive(100, 5000);
//   std::cout << create.DistanceTraveled().get() << " mm\n";
//   create.Bump().on([] { std::cout << "bump\n"; });
//   create.rr_object.connection().run_for(std::chrono::seconds(5));
//
// Everything waits, and throws the exceptions that the definition declares as their classes, all others as
// rr::ClientException; rr::Exception is the base of both.
#pragma once

#include <string_view>
#include <tuple>

#include "node/client/client.hpp"
#include "node/client/typed_handler.hpp"

namespace rr {

template <class T, class Parameter>
class TypedGenerator;

/// Base of generated clients: a handle that is cheap to copy. Members of the definition never begin with rr.
class ClientStub {
 public:
  /// The object without types.
  RemoteObject rr_object;

  /// For handles of members: runs a request.
  template <class Request>
  auto rr_try(Request&& request) const {
    try {
      return request(rr_object);
    } catch (const ClientException& failure) {
      throw_declared_(failure.error());
      throw;
    }
  }

 protected:
  /// Throws   ClientException: the object is neither of type `type` nor implements it.
  ClientStub(RemoteObject object, std::string_view type, ThrowDeclared throw_declared);

  template <class R, class... Args>
  R rr_call(std::string_view function, Args... arguments) const {
    const std::array<Value, sizeof...(Args)> values{pack_value(std::move(arguments))...};
    return unpack_value<R>(rr_try([&](const RemoteObject& object) { return object.call_values(function, values); }));
  }
  template <class T, class Parameter, class... Args>
  TypedGenerator<T, Parameter> rr_generator(std::string_view function, Args... arguments) const {
    const std::array<Value, sizeof...(Args)> values{pack_value(std::move(arguments))...};
    return {*this, rr_try([&](const RemoteObject& object) { return object.generator_values(function, values); })};
  }
  template <class Client, class... Index>
  Client rr_child(std::string_view objref, const Index&... index) const {
    return Client(rr_try([&](const RemoteObject& object) { return object.object(objref, index...); }));
  }

 private:
  ThrowDeclared throw_declared_;
};

/// What handles of members have in common: valid as long as the connection, whatever becomes of the client object.
class MemberHandle {
 public:
  /// `name`  outlives the handle: a literal.
  MemberHandle(const ClientStub& client, const char* name) : client_(client), name_(name) {}

 protected:
  template <class Request>
  auto ask(Request&& request) const {
    return client_.rr_try([&](const RemoteObject& object) { return request(object, name_); });
  }

 private:
  ClientStub client_;
  const char* name_;
};

template <class T, MemberDirection direction = MemberDirection::both>
class TypedProperty : public MemberHandle {
 public:
  using MemberHandle::MemberHandle;
  T get() const requires(direction != MemberDirection::writeonly) {
    return unpack_value<T>(ask([](const RemoteObject& object, const char* name) { return object.get(name); }));
  }
  void set(T value) const requires(direction != MemberDirection::readonly) {
    const Value packed = pack_value(std::move(value));
    ask([&](const RemoteObject& object, const char* name) { object.set(name, packed); });
  }
};

/// InValues come from the service, OutValues go to it.
template <class T, MemberDirection direction = MemberDirection::both>
class TypedWire : public MemberHandle {
 public:
  using MemberHandle::MemberHandle;
  /// handler(T) or handler(T, rr::TimeSpec) gets each InValue that is newer than the one before. Called while one of
  /// the functions of rr_object.connection() runs.
  template <class F>
  void connect(F handler) const requires(direction != MemberDirection::writeonly) {
    ask([&](const RemoteObject& object, const char* name) {
      object.connect_wire(name, detail::typed_wire_handler<T>(std::move(handler)));
    });
  }
  /// To send alone.
  void connect() const requires(direction != MemberDirection::readonly) {
    ask([](const RemoteObject& object, const char* name) { object.connect_wire(name, nullptr); });
  }
  void disconnect() const {
    ask([](const RemoteObject& object, const char* name) { object.disconnect_wire(name); });
  }
  /// On a connected wire.
  void send(T value) const requires(direction != MemberDirection::readonly) {
    const Value packed = pack_value(std::move(value));
    ask([&](const RemoteObject& object, const char* name) { object.send_wire(name, packed); });
  }
  T peek() const requires(direction != MemberDirection::writeonly) {
    return unpack_value<T>(ask([](const RemoteObject& object, const char* name) { return object.peek_in(name); }));
  }
  T peek_out() const requires(direction != MemberDirection::readonly) {
    return unpack_value<T>(ask([](const RemoteObject& object, const char* name) { return object.peek_out(name); }));
  }
  void poke(T value) const requires(direction != MemberDirection::readonly) {
    const Value packed = pack_value(std::move(value));
    ask([&](const RemoteObject& object, const char* name) { object.poke_out(name, packed); });
  }
};

template <class... Args>
class TypedEvent : public MemberHandle {
 public:
  using MemberHandle::MemberHandle;
  /// handler(Args...), one more; all are called, while one of the functions of rr_object.connection() runs.
  template <class F>
  HandlerRegistration on(F handler) const {
    return ask([&](const RemoteObject& object, const char* name) {
      return object.on_event(name, detail::typed_event_handler<Args...>(std::move(handler)));
    });
  }
};

/// One endpoint of a pipe, for as long as it is open: a handle that is cheap to copy.
template <class T, MemberDirection direction = MemberDirection::both>
class TypedPipeEndpoint {
 public:
  explicit TypedPipeEndpoint(RemotePipe pipe) : pipe_(std::move(pipe)) {}
  /// Waits while the stream is full.
  void send(T packet) const requires(direction != MemberDirection::readonly) {
    pipe_.send(pack_value(std::move(packet)));
  }
  void close() const { pipe_.close(); }
  std::int32_t index() const { return pipe_.index(); }
  bool is_open() const { return pipe_.is_open(); }

 private:
  RemotePipe pipe_;
};

template <class T, MemberDirection direction = MemberDirection::both>
class TypedPipe : public MemberHandle {
 public:
  using MemberHandle::MemberHandle;
  using Endpoint = TypedPipeEndpoint<T, direction>;
  /// handler(T) gets every packet, in order. Called while one of the functions of rr_object.connection() runs.
  template <class F>
  Endpoint connect(F handler, std::int32_t index = any_pipe_index) const
      requires(direction != MemberDirection::writeonly) {
    return open([handler = std::move(handler)](Value packet) mutable { handler(unpack_value<T>(packet)); }, index);
  }
  /// To send alone.
  Endpoint connect() const requires(direction != MemberDirection::readonly) { return open(nullptr, any_pipe_index); }

 private:
  Endpoint open(std::function<void(Value)> received, std::int32_t index) const {
    return Endpoint(ask([&](const RemoteObject& object, const char* name) {
      return object.connect_pipe(name, std::move(received), index);
    }));
  }
};

/// What the service asks of this client.
template <class R, class... Args>
class TypedCallback : public MemberHandle {
 public:
  using MemberHandle::MemberHandle;
  /// handler(Args...) returns an R. A second one replaces the first. What it throws, the service gets as an error.
  /// Called while one of the functions of rr_object.connection() runs.
  template <class F>
  void on(F handler) const {
    ask([&](const RemoteObject& object, const char* name) {
      object.on_callback_values(name, detail::typed_callback_handler<R, Args...>(std::move(handler)));
    });
  }
};

/// Positions and counts have one number a dimension. A: std::vector or MultiDim of the items.
template <class A, MemberDirection direction = MemberDirection::both>
class TypedMemory : public MemberHandle {
 public:
  using MemberHandle::MemberHandle;
  MemoryShape dimensions() const {
    return ask([](const RemoteObject& object, const char* name) { return object.memory(name).dimensions(); });
  }
  A read(const MemoryShape& position, const MemoryShape& count) const
      requires(direction != MemberDirection::writeonly) {
    return unpack_value<A>(
        ask([&](const RemoteObject& object, const char* name) { return object.memory(name).read(position, count); }));
  }
  /// All of it.
  A read() const requires(direction != MemberDirection::writeonly) {
    return unpack_value<A>(
        ask([](const RemoteObject& object, const char* name) { return object.memory(name).read(); }));
  }
  void write(const MemoryShape& position, A items) const requires(direction != MemberDirection::readonly) {
    const Value packed = pack_value(std::move(items));
    ask([&](const RemoteObject& object, const char* name) { object.memory(name).write(position, packed); });
  }
};

/// A running generator: a handle that can be copied. T void: it returns nothing; Parameter void: it takes nothing.
template <class T, class Parameter = void>
class TypedGenerator {
 public:
  TypedGenerator(const ClientStub& client, RemoteGenerator generator)
      : client_(client), generator_(std::move(generator)) {}

  /// The next value, std::nullopt after the last; of one that returns nothing, whether it has not ended.
  auto next() requires std::is_void_v<Parameter> {
    return convert(client_.rr_try([&](const RemoteObject&) { return generator_.next(); }));
  }
  template <class Given>
  requires std::is_convertible_v<Given, Parameter>
  auto next(Given&& given) {
    const Value packed = pack_value(Parameter(std::forward<Given>(given)));
    return convert(client_.rr_try([&](const RemoteObject&) { return generator_.next(packed); }));
  }
  /// What is not read to its end should be closed.
  void close() { generator_.close(); }
  void abort() { generator_.abort(); }

 private:
  static auto convert(const std::optional<Value>& value) {
    if constexpr (std::is_void_v<T>)
      return value.has_value();
    else
      return value ? std::optional<T>(unpack_value<T>(*value)) : std::nullopt;
  }

  ClientStub client_;
  RemoteGenerator generator_;
};

}  // namespace rr
