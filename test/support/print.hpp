// How Catch2 shows our types when a check fails; include it in tests that put a Result into REQUIRE or CHECK.
#pragma once

#include <catch2/catch.hpp>
#include <string>

#include "core/support/error.hpp"

namespace Catch {

template <>
struct StringMaker<rr::Error> {
  static std::string convert(const rr::Error& error) { return error.qualified_name() + ": " + error.message; }
};

template <class T>
struct StringMaker<boost::system::result<T, rr::Error>> {
  static std::string convert(const rr::Result<T>& result) {
    if (!result) return StringMaker<rr::Error>::convert(result.error());
    if constexpr (std::is_void_v<T>)
      return "ok";
    else
      return "ok: " + Detail::stringify(*result);
  }
};

}  // namespace Catch
