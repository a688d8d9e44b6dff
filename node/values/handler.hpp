// C++ callables as handlers of members: types deduced, arguments converted. Layer: node/values.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <tuple>
#include <type_traits>
#include <utility>
#include <vector>

#include "core/robdef/model/service_definition.hpp"
#include "core/types/value.hpp"

namespace rr {

/// What a handler of a member is for.
enum class HandlerSlot : std::uint8_t { call, get, set, wire_received };

/// A parameter or return type of a handler.
struct HandlerType {
  DataType type = DataType::void_t;  ///< varvalue_t: any Value
  bool is_array = false;
};

/// "int32", "double[]", "any value", "nothing".
std::string handler_type_text(const HandlerType& type);
/// Whether every value of `type` can be handed to a parameter of type `handler`. Numbers may widen (int16 to int32);
/// enums are int32.
bool accepts(const HandlerType& handler, const TypeDefinition& type);
/// Whether what a handler returns can be a value of `type`; numbers may be of any type, values are checked when they
/// are sent.
bool returns(const HandlerType& handler, const TypeDefinition& type);

class LateCall;

/// A callable with its deduced signature. It has either `call` or `start`.
struct Handler {
  std::vector<HandlerType> parameters;
  HandlerType result;
  /// Answers at once. `arguments` as many as `parameters`. Errors: data_type_mismatch, out_of_range.
  std::function<Result<Value>(std::span<const Value> arguments)> call;
  /// Answers later: see late_handler.hpp.
  std::function<void(std::vector<Value> arguments, const std::shared_ptr<LateCall>& call)> start = {};

  explicit operator bool() const { return call || start; }
};

namespace detail {

template <class T>
struct IsVector : std::false_type {};
template <class T>
struct IsVector<std::vector<T>> : std::true_type {
  using Item = T;
};

template <class T>
constexpr HandlerType handler_type() {
  using Plain = std::remove_cvref_t<T>;
  if constexpr (std::is_void_v<Plain>)
    return {};
  else if constexpr (Number<Plain>)
    return {data_type_of<Plain>(), false};
  else if constexpr (std::is_enum_v<Plain>)
    return {DataType::int32_t, false};
  else if constexpr (std::is_same_v<Plain, std::string> || std::is_same_v<Plain, std::string_view> ||
                     std::is_same_v<Plain, const char*>)
    return {DataType::string_t, false};
  else if constexpr (IsVector<Plain>::value)
    return {data_type_of<typename IsVector<Plain>::Item>(), true};
  else
    return {DataType::varvalue_t, false};
}

template <class T>
Result<T> from_value(const Value& value) {
  if constexpr (std::is_same_v<T, Value>) {
    return value;  // shares array payloads
  } else if constexpr (Number<T>) {
    return value.to<T>();
  } else if constexpr (std::is_enum_v<T>) {
    auto number = value.to<std::int32_t>();
    if (!number) return number.error();
    return static_cast<T>(*number);
  } else if constexpr (std::is_same_v<T, std::string> || std::is_same_v<T, std::string_view>) {
    auto text = value.to_text();
    if (!text) return text.error();
    return T(*text);
  } else {
    static_assert(IsVector<T>::value, "a handler takes numbers, strings, vectors of numbers, or rr::Value");
    auto items = value.to_items<typename IsVector<T>::Item>();
    if (!items) return items.error();
    return T(items->begin(), items->end());
  }
}

}  // namespace detail

template <class T>
Value to_value(T&& value) {
  using Plain = std::remove_cvref_t<T>;
  if constexpr (std::is_enum_v<Plain>)
    return Value(static_cast<std::int32_t>(value));
  else
    return Value(std::forward<T>(value));
}

namespace detail {

/// Converts each argument to its C++ type and returns what `use` makes of them, or the error of the first that does not
/// convert.
template <class... Args, std::size_t... Index, class Use>
auto with_arguments(std::span<const Value> arguments, std::index_sequence<Index...>, Use&& use)
    -> decltype(use(std::declval<std::remove_cvref_t<Args>>()...)) {
  if (arguments.size() != sizeof...(Args))
    return make_error(ErrorCode::invalid_argument, "wrong number of arguments for the handler");
  [[maybe_unused]] std::tuple converted{from_value<std::remove_cvref_t<Args>>(arguments[Index])...};
  std::optional<Error> failure;
  ((std::get<Index>(converted).has_error() ? void(failure = std::get<Index>(converted).error()) : void()), ...);
  if (failure) return std::move(*failure);
  return use(std::move(*std::get<Index>(converted))...);
}

/// Return and parameter types of a callable, as an argument to deduce them from.
template <class R, class... Args>
struct SignatureTag {};

template <class F>
struct SignatureOf : SignatureOf<decltype(&F::operator())> {};
template <class R, class... Args>
struct SignatureOf<R(Args...)> {
  using Tag = SignatureTag<R, Args...>;
};
template <class R, class... Args>
struct SignatureOf<R (*)(Args...)> : SignatureOf<R(Args...)> {};
template <class C, class R, class... Args>
struct SignatureOf<R (C::*)(Args...)> : SignatureOf<R(Args...)> {};
template <class C, class R, class... Args>
struct SignatureOf<R (C::*)(Args...) const> : SignatureOf<R(Args...)> {};

/// Of a callable whose operator() is not overloaded.
template <class F>
using SignatureTagOf = typename SignatureOf<std::remove_cvref_t<F>>::Tag;

template <class R, class... Args, class F>
Result<Value> call_function(F& function, std::span<const Value> arguments) {
  return with_arguments<Args...>(arguments, std::index_sequence_for<Args...>{},
                                 [&](std::remove_cvref_t<Args>... converted) -> Result<Value> {
                                   if constexpr (std::is_void_v<R>) {
                                     function(std::move(converted)...);
                                     return Value{};
                                   } else {
                                     return to_value(function(std::move(converted)...));
                                   }
                                 });
}

template <class R, class... Args, class F>
Handler make_typed_handler(SignatureTag<R, Args...>, F function) {
  Handler handler;
  handler.parameters = {handler_type<Args>()...};
  handler.result = handler_type<R>();
  handler.call = [function = std::move(function)](std::span<const Value> arguments) mutable {
    return call_function<R, Args...>(function, arguments);
  };
  return handler;
}

}  // namespace detail

/// Wraps a callable that answers at once and whose operator() is not overloaded.
template <class F>
Handler make_plain_handler(F&& function) {
  return detail::make_typed_handler(detail::SignatureTagOf<F>{}, std::forward<F>(function));
}

}  // namespace rr
