// What generated client classes have in common, waiting ones and asynchronous ones: handlers with C++ types. Layer:
// node/client.
#pragma once

#include <span>
#include <type_traits>
#include <utility>

#include "node/client/client_connection.hpp"
#include "node/values/typed_value.hpp"

namespace rr {

inline constexpr auto readonly = MemberDirection::readonly;
inline constexpr auto writeonly = MemberDirection::writeonly;

/// Throws the class that a definition declares for an error; returns where there is none.
using ThrowDeclared = void (*)(const Error& error);

namespace detail {

/// Whether the object at `path` is of a type, or implements it.
/// Errors   object_not_found: it is none.
Result<> check_object_type(const ClientConnection& connection, std::string_view path, std::string_view type);

/// handler(T) or handler(T, TimeSpec).
template <class T, class F>
ClientConnection::WireHandler typed_wire_handler(F handler) {
  return [handler = std::move(handler)](const Value& value, TimeSpec time) mutable {
    if constexpr (std::is_invocable_v<F&, T, TimeSpec>)
      handler(unpack_value<T>(value), time);
    else
      handler(unpack_value<T>(value));
  };
}

template <class... Args, class F>
ClientConnection::EventHandler typed_event_handler(F handler) {
  return [handler = std::move(handler)]([[maybe_unused]] std::span<const Value> arguments) mutable {
    if (arguments.size() != sizeof...(Args)) return;
    [&]<std::size_t... index>(std::index_sequence<index...>) {
      handler(unpack_value<Args>(arguments[index])...);
    }
    (std::index_sequence_for<Args...>{});
  };
}

template <class R, class... Args, class F>
ClientConnection::CallbackHandler typed_callback_handler(F handler) {
  return [handler = std::move(handler)](std::span<const Value> arguments) mutable -> Result<Value> {
    if (arguments.size() != sizeof...(Args))
      return make_error(ErrorCode::invalid_argument, "wrong number of arguments");
    return [&]<std::size_t... index>(std::index_sequence<index...>)->Result<Value> {
      if constexpr (std::is_void_v<R>) {
        handler(unpack_value<Args>(arguments[index])...);
        return Value{};
      } else {
        return pack_value<R>(handler(unpack_value<Args>(arguments[index])...));
      }
    }
    (std::index_sequence_for<Args...>{});
  };
}

}  // namespace detail

}  // namespace rr
