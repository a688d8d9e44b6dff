// A buffer of pages of its own. Layer: node/platform.
#pragma once

#include <sys/mman.h>

#include <cstdint>
#include <new>
#include <span>

namespace rr {

/// Straight from the system and back to it: it becomes memory only as far as it is used. What malloc() gives may have
/// been used before, and is kept when it is freed, so that thousands of connections that come and go would leave all of
/// it.
class PageBuffer {
 public:
  /// Throws   std::bad_alloc.
  explicit PageBuffer(std::size_t size)
      : data_(::mmap(nullptr, size, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0)), size_(size) {
    if (data_ == MAP_FAILED) throw std::bad_alloc();
  }
  ~PageBuffer() { ::munmap(data_, size_); }
  PageBuffer(const PageBuffer&) = delete;
  PageBuffer& operator=(const PageBuffer&) = delete;

  std::uint8_t* data() const { return static_cast<std::uint8_t*>(data_); }
  std::size_t size() const { return size_; }
  operator std::span<std::uint8_t>() const { return {data(), size_}; }

 private:
  void* data_;
  std::size_t size_;
};

}  // namespace rr
