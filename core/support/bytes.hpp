// Bytes borrowed and owned. Layer: support.
#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <string_view>
#include <type_traits>
#include <vector>

namespace rr {

static_assert(std::endian::native == std::endian::little,
              "Robot Raconteur is little-endian on the wire and arrays travel without a per-element loop");

/// Borrowed bytes: valid for the call unless the function that hands them out says longer.
using ByteSpan = std::span<const std::uint8_t>;
using Bytes = std::vector<std::uint8_t>;

inline ByteSpan as_bytes(std::string_view text) {
  return {reinterpret_cast<const std::uint8_t*>(text.data()), text.size()};
}

inline std::string_view as_text(ByteSpan bytes) {
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

/// Buffers are kept for their memory, but not above this many bytes each: what one large message took is given back
/// when that is done, and a steady stream of small ones allocates nothing.
inline constexpr std::size_t max_kept_bytes = 64 * 1024;

/// Empties a buffer that is used again and again.
template <class T>
void clear_kept(std::vector<T>& buffer) {
  if (buffer.capacity() * sizeof(T) > max_kept_bytes)
    buffer = std::vector<T>();
  else
    buffer.clear();
}

/// Reads one little-endian number; `from` need not be aligned but must hold sizeof(T) bytes.
template <class T>
requires std::is_trivially_copyable_v<T> T load(const std::uint8_t* from) {
  T value;
  std::memcpy(&value, from, sizeof(T));
  return value;
}

}  // namespace rr
