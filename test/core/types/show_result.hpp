// How Catch2 shows a Result. Include it in every test file that checks one.
#pragma once

#include <catch2/catch.hpp>

#include "core/support/error.hpp"

/// A failed CHECK shows the error.
template <class T>
struct Catch::StringMaker<boost::system::result<T, rr::Error>> {
  static std::string convert(const boost::system::result<T, rr::Error>& result) {
    return result ? "a value" : result.error().message;
  }
};
