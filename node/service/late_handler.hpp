// Handlers that may wait: coroutines, callables that block, callables that are handed a Reply. Layer: node.
//
//   service->function("Home", [&](double speed) -> boost::asio::awaitable<void> {
//     co_await robot.async_home(speed);
//   });
//   service->function("Capture", rr::blocking([&](std::int32_t exposure) { return camera.capture(exposure); }));
//   service->function("Weigh", [&](rr::Reply<double> reply) { scale.on_settled([reply](double kg) { reply(kg); }); });
//
// Coroutines run on the node's thread. Blocking handlers run on threads of the node's pool, several side by side, also
// of one member: what they share needs a lock, and what they tell clients goes by Node::post(). A Reply may be called
// from any thread. None of them keeps anybody waiting but the client that called; answers go out as they come.
//
// When the client goes, a coroutine is cancelled by its cancellation slot, a blocking handler that has not begun never
// does, and answers are dropped. The coroutine of a generator is cancelled also when its client aborts it or its object
// is replaced. The destructor of a node waits for blocking handlers that run.
#pragma once

#include <boost/asio/awaitable.hpp>
#include <boost/asio/bind_cancellation_slot.hpp>
#include <boost/asio/co_spawn.hpp>
#include <exception>
#include <memory>
#include <tuple>
#include <type_traits>
#include <utility>
#include <vector>

#include "node/service/late_call.hpp"
#include "node/service/memory.hpp"
#include "node/values/exception.hpp"
#include "node/values/handler.hpp"

namespace rr {

/// Answers one request: from any thread, at any time, once. Cheap to copy; where all copies are gone without an answer
/// the client hears that. A handler takes it as its last parameter; T is what the member returns, or void.
template <class T = Value>
class Reply {
 public:
  explicit Reply(std::shared_ptr<LateCall> call) : call_(std::move(call)) {}
  void operator()(T value) const { call_->answer(to_value(std::move(value))); }
  void fail(Error error) const { call_->answer(std::move(error)); }
  /// Who has called.
  const Caller& caller() const { return call_->caller(); }

 private:
  std::shared_ptr<LateCall> call_;
};
template <>
class Reply<void> {
 public:
  explicit Reply(std::shared_ptr<LateCall> call) : call_(std::move(call)) {}
  void operator()() const { call_->answer(Value{}); }
  void fail(Error error) const { call_->answer(std::move(error)); }
  const Caller& caller() const { return call_->caller(); }

 private:
  std::shared_ptr<LateCall> call_;
};

template <class F>
struct Blocking {
  F function;
};

/// Marks a handler that blocks: it runs on the node's pool.
template <class F>
Blocking<std::decay_t<F>> blocking(F&& function) {
  return {std::forward<F>(function)};
}

inline MemoryHandlers blocking(MemoryHandlers handlers) {
  handlers.is_blocking = true;
  return handlers;
}

namespace detail {

template <class R>
struct AwaitedBy : std::false_type {};
template <class T, class Executor>
struct AwaitedBy<boost::asio::awaitable<T, Executor>> : std::true_type {
  using Type = T;
};

template <class T>
struct RepliedBy : std::false_type {};
template <class T>
struct RepliedBy<Reply<T>> : std::true_type {
  using Type = T;
};
template <class... Args>
struct LastOf : std::type_identity<void> {};
template <class T>
struct LastOf<T> : std::type_identity<std::remove_cvref_t<T>> {};
template <class T, class U, class... Args>
struct LastOf<T, U, Args...> : LastOf<U, Args...> {};

/// `arguments` as C++ values; texts of type std::string_view borrow from them.
template <class... Args>
Result<std::tuple<std::remove_cvref_t<Args>...>> convert_arguments(std::span<const Value> arguments) {
  using Tuple = std::tuple<std::remove_cvref_t<Args>...>;
  return with_arguments<Args...>(
      arguments, std::index_sequence_for<Args...>{},
      [](std::remove_cvref_t<Args>... converted) -> Result<Tuple> { return Tuple(std::move(converted)...); });
}

/// The frame keeps what the handler's coroutine may refer to: its captures and its arguments.
template <class T, class... Args, class F>
boost::asio::awaitable<void> answer_by(std::shared_ptr<F> function, std::vector<Value> arguments,
                                       std::shared_ptr<LateCall> call) {
  Result<Value> answer = Value{};
  try {
    auto converted = convert_arguments<Args...>(arguments);
    if (!converted) {
      answer = converted.error();
    } else if constexpr (std::is_void_v<T>) {
      co_await std::apply(*function, std::move(*converted));
    } else {
      auto value = co_await std::apply(*function, std::move(*converted));
      answer = to_value(std::move(value));
    }
  } catch (...) {
    answer = handler_error(std::current_exception());
  }
  call->answer(std::move(answer));
}

template <class R, class... Args, class F>
Handler make_coroutine_handler(SignatureTag<R, Args...>, F function) {
  using T = typename AwaitedBy<R>::Type;
  Handler handler;
  handler.parameters = {handler_type<Args>()...};
  handler.result = handler_type<T>();
  handler.start = [function = std::make_shared<F>(std::move(function))](std::vector<Value> arguments,
                                                                        const std::shared_ptr<LateCall>& call) {
    const auto keep = [call](const std::exception_ptr&) {};  // the coroutine uses the slot until this is called
    boost::asio::co_spawn(call->executor(), answer_by<T, Args...>(function, std::move(arguments), call),
                          boost::asio::bind_cancellation_slot(call->cancellation_slot(), keep));
  };
  return handler;
}

template <class R, class... Args, class F>
Handler make_blocking_handler(SignatureTag<R, Args...>, F function) {
  Handler handler;
  handler.parameters = {handler_type<Args>()...};
  handler.result = handler_type<R>();
  handler.start = [function = std::make_shared<F>(std::move(function))](std::vector<Value> arguments,
                                                                        const std::shared_ptr<LateCall>& call) {
    call->run_blocking([function, arguments = std::move(arguments), call]() mutable {
      Result<Value> answer = Value{};
      try {
        answer = call_function<R, Args...>(*function, arguments);
      } catch (...) {
        answer = handler_error(std::current_exception());
      }
      call->answer(std::move(answer), std::move(function));
    });
  };
  return handler;
}

template <class R, class... All, class F, std::size_t... Index>
Handler make_reply_handler(SignatureTag<R, All...>, F function, std::index_sequence<Index...>) {
  static_assert(std::is_void_v<R>, "a handler that takes a Reply returns nothing");
  using Types = std::tuple<SignatureTag<All>...>;
  using T = typename RepliedBy<typename LastOf<All...>::type>::Type;
  return [&]<class... Args>(SignatureTag<Args>...) {
    Handler handler;
    handler.parameters = {handler_type<Args>()...};
    handler.result = handler_type<T>();
    handler.start = [function = std::move(function)](std::vector<Value> arguments,
                                                     const std::shared_ptr<LateCall>& call) mutable {
      auto converted = convert_arguments<Args...>(arguments);
      if (!converted) return call->answer(converted.error());
      std::apply([&](auto&... values) { function(std::move(values)..., Reply<T>(call)); }, *converted);
    };
    return handler;
  }(std::tuple_element_t<Index, Types>{}...);
}

}  // namespace detail

/// Wraps a callable whose operator() is not overloaded: one that returns at once, a coroutine, or one that takes a
/// Reply.
template <class F>
Handler make_handler(F&& function) {
  return []<class R, class... Args>(detail::SignatureTag<R, Args...> tag, auto&& callable) {
    if constexpr (detail::AwaitedBy<R>::value)
      return detail::make_coroutine_handler(tag, std::forward<F>(callable));
    else if constexpr (detail::RepliedBy<typename detail::LastOf<Args...>::type>::value)
      return detail::make_reply_handler(tag, std::forward<F>(callable),
                                        std::make_index_sequence<sizeof...(Args) - 1>{});
    else
      return make_plain_handler(std::forward<F>(callable));
  }(detail::SignatureTagOf<F>{}, std::forward<F>(function));
}
/// One that was put together by hand.
inline Handler make_handler(Handler handler) {
  return handler;
}
template <class F>
Handler make_handler(Blocking<F> marked) {
  return detail::make_blocking_handler(detail::SignatureTagOf<F>{}, std::move(marked.function));
}

}  // namespace rr
