// What an input may make the program allocate: an oracle for fuzzers, by the hooks of AddressSanitizer.
#pragma once

#include <sanitizer/allocator_interface.h>

#include <atomic>
#include <cstddef>
#include <cstdio>
#include <cstdlib>

namespace rr::fuzz {

/// Aborts at its end where so much more was in use at a time than when it began: `base` bytes, and `factor` for each
/// byte of the input. Counts all threads. One at a time.
class MemoryBound {
 public:
  explicit MemoryBound(std::size_t input_bytes, std::size_t base = 16u << 20, std::size_t factor = 512)
      : limit_(static_cast<std::ptrdiff_t>(base + factor * input_bytes)), input_bytes_(input_bytes) {
    static const bool is_installed = __sanitizer_install_malloc_and_free_hooks(&note_allocated, &note_freed) != 0;
    if (!is_installed) std::abort();
    before_ = in_use;
    most = before_;
  }
  MemoryBound(const MemoryBound&) = delete;
  MemoryBound& operator=(const MemoryBound&) = delete;
  ~MemoryBound() {
    const auto used = most - before_;
    if (used <= limit_) return;
    std::fprintf(stderr, "broken: %td bytes in use for an input of %zu, at most %td expected\n", used, input_bytes_,
                 limit_);
    std::abort();
  }

 private:
  static inline std::atomic<std::ptrdiff_t> in_use = 0;
  static inline std::atomic<std::ptrdiff_t> most = 0;

  static void note_allocated(const volatile void*, std::size_t size) {
    const auto now = in_use += static_cast<std::ptrdiff_t>(size);
    if (now > most) most = now;  // another thread's may be missed, which matters little
  }
  static void note_freed(const volatile void* memory) {
    if (memory) in_use -= static_cast<std::ptrdiff_t>(__sanitizer_get_allocated_size(const_cast<void*>(memory)));
  }

  std::ptrdiff_t limit_;
  std::size_t input_bytes_;
  std::ptrdiff_t before_ = 0;
};

}  // namespace rr::fuzz
