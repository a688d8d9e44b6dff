// A function that may be replaced, or lost with its owner, while it runs. Layer: node/values.
#pragma once

#include <functional>
#include <memory>
#include <type_traits>
#include <utility>

namespace rr {

/// As std::function, but copies share the function and its state: who calls a copy needs not fear for the original.
template <class Signature>
class SharedFunction;
template <class R, class... Args>
class SharedFunction<R(Args...)> {
 public:
  using Function = std::function<R(Args...)>;

  SharedFunction() = default;
  /// Empty where `function` is.
  template <class F>
  requires(std::is_constructible_v<Function, F> && !std::is_same_v<std::remove_cvref_t<F>, SharedFunction>)
      SharedFunction(F&& function) {
    if (Function made(std::forward<F>(function)); made) function_ = std::make_shared<const Function>(std::move(made));
  }

  explicit operator bool() const { return function_ != nullptr; }
  R operator()(Args... args) const { return (*function_)(std::forward<Args>(args)...); }

 private:
  std::shared_ptr<const Function> function_;
};

}  // namespace rr
