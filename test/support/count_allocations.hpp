// Counts what a test program allocates. For one source file of a program: it replaces operator new, which sanitizers
// replace as well.
#pragma once

#include <malloc.h>

#include <cstddef>
#include <cstdlib>
#include <new>

namespace rr::test {

inline std::size_t allocation_count = 0;
inline std::size_t allocated_bytes = 0;  ///< asked for, in total
inline std::size_t live_bytes = 0;       ///< not given back yet
inline std::size_t peak_bytes = 0;       ///< the most of them since this was set

inline void* counted_allocation(std::size_t size) {
  void* memory = std::malloc(size == 0 ? 1 : size);
  if (!memory) throw std::bad_alloc();
  ++allocation_count;
  allocated_bytes += size;
  live_bytes += malloc_usable_size(memory);
  if (live_bytes > peak_bytes) peak_bytes = live_bytes;
  return memory;
}

inline void counted_free(void* memory) {
  live_bytes -= malloc_usable_size(memory);
  std::free(memory);
}

}  // namespace rr::test

void* operator new(std::size_t size) {
  return rr::test::counted_allocation(size);
}
void* operator new[](std::size_t size) {
  return rr::test::counted_allocation(size);
}
void operator delete(void* memory) noexcept {
  rr::test::counted_free(memory);
}
void operator delete(void* memory, std::size_t) noexcept {
  rr::test::counted_free(memory);
}
void operator delete[](void* memory) noexcept {
  rr::test::counted_free(memory);
}
void operator delete[](void* memory, std::size_t) noexcept {
  rr::test::counted_free(memory);
}
