// What the C++ library and Boost want from their surroundings: there is no operating system around, only js_values.ts.
// Layer: wasm-client/src.
#include <cstddef>
#include <cstdlib>
#include <exception>

#include "core/support/error.hpp"

extern "C" {
__attribute__((import_module("js"), import_name("random"))) void rr_js_random(void* to, std::size_t size);

/// For std::random_device.
int getentropy(void* to, std::size_t size) {
  rr_js_random(to, size);
  return 0;
}

/// Where std::abort() ends: JavaScript sees a WebAssembly.RuntimeError.
void _Exit(int) {
  __builtin_trap();
}

/// Views on the memory are made anew by whoever holds one.
void emscripten_notify_memory_growth(std::size_t) {}
}

#ifdef BOOST_NO_EXCEPTIONS
/// Boost reports what cannot happen (a Result read without looking) by throwing; without exceptions the module ends.
namespace boost {
BOOST_NORETURN void throw_exception(const std::exception&) {
  std::abort();
}
BOOST_NORETURN void throw_exception(const std::exception&, const boost::source_location&) {
  std::abort();
}
}  // namespace boost
#endif
