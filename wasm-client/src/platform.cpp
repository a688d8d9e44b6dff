// What the C++ library wants from its surroundings: there is no operating system around, only js_values.ts.
// Layer: wasm-client/src.
#include <cstddef>
#include <cstdlib>

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
