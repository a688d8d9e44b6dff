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
// nothing. The inner one may take its time: as a coroutine, or as rr::blocking([=]() mutable {...}); it is asked for
// one value at a time. What else has to be known, close and abort, takes an rr::Generator instead of the inner
// callable.
#pragma once

#include <functional>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "node/service/late_handler.hpp"

namespace rr {

/// One running generator of one client. Destroyed when it has ended, or its client or object has gone.
struct Generator {
  /// The next value, or std::nullopt for the end. `parameter` is null where the definition has none; a generator that
  /// only takes values returns any. An error, like an exception, ends the generator too.
  std::function<Result<std::optional<Value>>(const Value& parameter)> next;
  /// The client needs no more.
  std::function<void()> close = {};
  /// The client wants it to stop at once, or has gone, or has not asked for ten minutes, or its object was replaced.
  /// Also while a value is waited for: the client does not get that any more.
  std::function<void()> abort = {};
  /// Instead of `next` where that takes its time: `call` is answered with the value, with the error stop_iteration at
  /// the end, or with another one.
  std::function<void(Value parameter, const std::shared_ptr<LateCall>& call)> start = {};
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

/// What a step has returned.
template <class R>
std::optional<Value> step_value(R value) {
  if constexpr (IsOptional<R>::value) {
    if (!value) return std::nullopt;
    return to_value(std::move(*value));
  } else {
    static_assert(std::is_same_v<R, bool>, "a generator returns std::optional of a value, or bool or void");
    return value ? std::optional<Value>(Value{}) : std::nullopt;
  }
}

template <class R, class F, class... Parameter>
Result<std::optional<Value>> take_step(F& function, Parameter&&... parameter) {
  if constexpr (std::is_void_v<R>) {
    function(std::forward<Parameter>(parameter)...);
    return std::optional<Value>(Value{});
  } else {
    return step_value<R>(function(std::forward<Parameter>(parameter)...));
  }
}

/// A step as an answer: the end, and whatever else is no value, is an error.
inline Result<Value> step_answer(Result<std::optional<Value>> step) {
  if (!step) return step.error();
  if (!*step) return make_error(ErrorCode::stop_iteration, {});
  return std::move(**step);
}

/// `Parameter`: one or none.
template <class T, class... Parameter, class F>
boost::asio::awaitable<void> answer_step_by(std::shared_ptr<F> function, std::vector<Value> given,
                                            std::shared_ptr<LateCall> call) {
  Result<std::optional<Value>> step = std::optional<Value>(Value{});
  try {
    auto converted = convert_arguments<Parameter...>(given);
    if (!converted) {
      step = converted.error();
    } else if constexpr (std::is_void_v<T>) {
      co_await std::apply(*function, std::move(*converted));
    } else {
      auto value = co_await std::apply(*function, std::move(*converted));
      step = step_value<T>(std::move(value));
    }
  } catch (...) {
    step = handler_error(std::current_exception());
  }
  call->answer(step_answer(std::move(step)));
}

/// A generator by a callable that is no coroutine, or by one.
template <class R, class... Parameter, class F>
Generator make_step_generator(F function) {
  Generator generator;
  if constexpr (AwaitedBy<R>::value) {
    generator.start = [function = std::make_shared<F>(std::move(function))](Value given,
                                                                            const std::shared_ptr<LateCall>& call) {
      std::vector<Value> arguments;
      if (sizeof...(Parameter) > 0) arguments.push_back(std::move(given));
      const auto keep = [call](const std::exception_ptr&) {};  // the coroutine uses the slot until this is called
      boost::asio::co_spawn(
          call->executor(),
          answer_step_by<typename AwaitedBy<R>::Type, Parameter...>(function, std::move(arguments), call),
          boost::asio::bind_cancellation_slot(call->cancellation_slot(), keep));
    };
  } else {
    generator.next = [function = std::move(function)](const Value& given) mutable {
      return with_arguments<Parameter...>(
          std::span(&given, sizeof...(Parameter)), std::index_sequence_for<Parameter...>{},
          [&](std::remove_cvref_t<Parameter>... converted) { return take_step<R>(function, std::move(converted)...); });
    };
  }
  return generator;
}

/// One whose `next` blocks.
inline Generator make_blocking_generator(Generator generator) {
  using Next = decltype(generator.next);
  generator.start = [next = std::make_shared<Next>(std::move(generator.next))](Value given,
                                                                               const std::shared_ptr<LateCall>& call) {
    call->run_blocking([next, given = std::move(given), call]() mutable {
      Result<Value> answer = Value{};
      try {
        answer = step_answer((*next)(given));
      } catch (...) {
        answer = handler_error(std::current_exception());
      }
      call->answer(std::move(answer), std::move(next));
    });
  };
  generator.next = nullptr;
  return generator;
}

template <class R>
constexpr HandlerType step_value_type() {
  if constexpr (AwaitedBy<R>::value)
    return step_value_type<typename AwaitedBy<R>::Type>();
  else if constexpr (IsOptional<R>::value)
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
    return make_step_generator<R>(std::move(function));
  }
};
template <class C, class R, class P>
struct StepSignature<R (C::*)(P)> {
  static std::vector<HandlerType> parameters() { return {handler_type<P>()}; }
  static constexpr HandlerType value = step_value_type<R>();
  template <class F>
  static Generator make(F function) {
    return make_step_generator<R, P>(std::move(function));
  }
};
template <class C, class R, class... P>
struct StepSignature<R (C::*)(P...) const> : StepSignature<R (C::*)(P...)> {};

template <class F>
struct StepSignature<Blocking<F>> {
  static std::vector<HandlerType> parameters() { return StepSignature<F>::parameters(); }
  static constexpr HandlerType value = StepSignature<F>::value;
  static Generator make(Blocking<F> marked) {
    return make_blocking_generator(StepSignature<F>::make(std::move(marked.function)));
  }
};

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
