// How errors leave coroutines that answer requests. Layer: server/http/endpoints.
#pragma once

#include <string>
#include <type_traits>
#include <utility>

#include "node/values/exception.hpp"

namespace rrgate {

/// An exception is how an error gets out of a coroutine here: one place answers them all.
template <class T>
T value_or_throw(rr::Result<T> result) {
  if (!result) throw rr::Exception(result.error());
  if constexpr (!std::is_void_v<T>) return std::move(*result);
}

[[noreturn]] inline void refuse(rr::ErrorCode code, std::string why) {
  throw rr::Exception(rr::make_error(code, std::move(why)));
}

}  // namespace rrgate
