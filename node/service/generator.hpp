// Generator functions of a service: C++ callables as generators. Layer: node/service.
//
//   service->generator("Count", [](std::int32_t last) {
//     return [i = 0, last]() mutable -> std::optional<std::int32_t> {
//       if (i == last) return std::nullopt;  // the end
//       return i++;
//     };
//   });
//
// The outer callable takes the function's parameters, the inner one is asked for each value: it takes the generator
// parameter where the definition has one. A generator that only takes values returns whether it wants more (bool), or
// nothing. What else has to be known, close and abort, takes an rr::Generator instead of the inner callable.
#pragma once

#include <functional>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "node/values/handler.hpp"

namespace rr {

/// One running generator of one client. Destroyed when it has ended, or its client or object has gone.
struct Generator {
  /// The next value, or std::nullopt for the end. `parameter` is null where the definition has none; a generator that
  /// only takes values returns any. An error, like an exception, ends the generator too.
  std::function<Result<std::optional<Value>>(const Value& parameter)> next;
  /// The client needs no more.
  std::function<void()> close = {};
  /// The client wants it to stop at once, or has gone, or has not asked for ten minutes.
  std::function<void()> abort = {};
};

/// A callable that makes generators, with its deduced signature.
struct GeneratorHandler {
  std::vector<HandlerType> parameters;
  std::vector<HandlerType> step_parameters;  ///< one where the generator takes values
  HandlerType value;                         ///< nothing: it returns none
  bool checks_itself = false;                ///< makes rr::Generator: any definition will do
  /// `arguments` as many as `parameters`.
  std::function<Result<Generator>(std::span<const Value>)> open;
};

namespace detail {

template <class T>
struct IsOptional : std::false_type {};
template <class T>
struct IsOptional<std::optional<T>> : std::true_type {
  using Item = T;
};

template <class R, class F, class... Parameter>
Result<std::optional<Value>> take_step(F& function, Parameter&&... parameter) {
  if constexpr (IsOptional<R>::value) {
    auto value = function(std::forward<Parameter>(parameter)...);
    if (!value) return std::optional<Value>();
    return std::optional<Value>(to_value(std::move(*value)));
  } else if constexpr (std::is_void_v<R>) {
    function(std::forward<Parameter>(parameter)...);
    return std::optional<Value>(Value{});
  } else {
    static_assert(std::is_same_v<R, bool>, "a generator returns std::optional of a value, or bool or void");
    return function(std::forward<Parameter>(parameter)...) ? std::optional<Value>(Value{}) : std::nullopt;
  }
}

template <class R>
constexpr HandlerType step_value_type() {
  if constexpr (IsOptional<R>::value)
    return handler_type<typename IsOptional<R>::Item>();
  else
    return {};
}

template <class F>
struct StepSignature : StepSignature<decltype(&F::operator())> {};
template <class C, class R>
struct StepSignature<R (C::*)()> {
  static std::vector<HandlerType> parameters() { return {}; }
  static constexpr HandlerType value = step_value_type<R>();
  template <class F>
  static Generator make(F function) {
    return {[function = std::move(function)](const Value&) mutable { return take_step<R>(function); }};
  }
};
template <class C, class R, class P>
struct StepSignature<R (C::*)(P)> {
  static std::vector<HandlerType> parameters() { return {handler_type<P>()}; }
  static constexpr HandlerType value = step_value_type<R>();
  template <class F>
  static Generator make(F function) {
    return {[function = std::move(function)](const Value& given) mutable {
      return with_arguments<P>(std::span(&given, 1), std::index_sequence_for<P>{},
                               [&](std::remove_cvref_t<P> converted) -> Result<std::optional<Value>> {
                                 return take_step<R>(function, std::move(converted));
                               });
    }};
  }
};
template <class C, class R, class... P>
struct StepSignature<R (C::*)(P...) const> : StepSignature<R (C::*)(P...)> {};

template <class R, class... Args, class F>
GeneratorHandler make_typed_generator_handler(SignatureTag<R, Args...>, F function) {
  GeneratorHandler handler;
  handler.parameters = {handler_type<Args>()...};
  constexpr bool is_generator = std::is_same_v<R, Generator>;
  if constexpr (is_generator) {
    handler.checks_itself = true;
  } else {
    handler.step_parameters = StepSignature<R>::parameters();
    handler.value = StepSignature<R>::value;
  }
  handler.open = [function = std::move(function)](std::span<const Value> arguments) mutable {
    return with_arguments<Args...>(arguments, std::index_sequence_for<Args...>{},
                                   [&](std::remove_cvref_t<Args>... converted) -> Result<Generator> {
                                     if constexpr (is_generator)
                                       return function(std::move(converted)...);
                                     else
                                       return StepSignature<R>::make(function(std::move(converted)...));
                                   });
  };
  return handler;
}

}  // namespace detail

/// Wraps a callable whose operator() is not overloaded, and that returns such a callable or an rr::Generator.
template <class F>
GeneratorHandler make_generator_handler(F&& function) {
  return detail::make_typed_generator_handler(detail::SignatureTagOf<F>{}, std::forward<F>(function));
}

/// One that was put together by hand.
inline GeneratorHandler make_generator_handler(GeneratorHandler handler) {
  return handler;
}

}  // namespace rr
