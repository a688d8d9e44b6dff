// Where a connection reads to. Layer: node/platform.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <memory>
#include <span>

#include "node/platform/page_buffer.hpp"

namespace rr {

/// Little room for who says little, as thousands of idle connections do, and many pages for who has more to say, until
/// he has not for a while.
class ReadBuffer {
 public:
  static constexpr std::size_t small_size = 1024;
  static constexpr std::size_t much = small_size / 2;  ///< in one read; not all of it: a stream may take frames off
  static constexpr unsigned few_reads = 64;            ///< in a row, each of less: the pages are given back

  /// `large_size`  never more.
  explicit ReadBuffer(std::size_t large_size) : large_size_(large_size) {}

  /// For the next read; what is in it is not needed any more. Throws   std::bad_alloc.
  std::span<std::uint8_t> renew() {
    if (!wants_large_)
      large_.reset();
    else if (!large_)
      large_ = std::make_unique<PageBuffer>(large_size_);
    return room();
  }
  /// The same as before.
  std::span<std::uint8_t> room() {
    return large_ ? std::span<std::uint8_t>(*large_) : std::span(small_).first(std::min(small_size, large_size_));
  }
  /// What is in it after a read.
  void note_read(std::size_t bytes) {
    if (bytes >= much) {
      wants_large_ = true;
      small_reads_ = 0;
    } else if (wants_large_ && ++small_reads_ == few_reads) {
      wants_large_ = false;
    }
  }

 private:
  const std::size_t large_size_;
  std::unique_ptr<PageBuffer> large_;
  std::array<std::uint8_t, small_size> small_;
  bool wants_large_ = false;
  unsigned small_reads_ = 0;  ///< in a row
};

}  // namespace rr
