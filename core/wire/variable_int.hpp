// Widths of the variable-length integers uint_x and int_x of version 4. Layer: wire. Source: messages spec section 1.
#pragma once

#include <cstddef>
#include <cstdint>

namespace rr {

/// First bytes that announce a wider number.
inline constexpr std::uint8_t uint_x_u16 = 0xfd;
inline constexpr std::uint8_t uint_x_u32 = 0xfe;
inline constexpr std::uint8_t int_x_i16 = 0x7d;
inline constexpr std::uint8_t int_x_i32 = 0x7e;

/// Bytes of the shortest form, the only one that may be written.
constexpr std::size_t uint_x_size(std::uint32_t value) {
  if (value < uint_x_u16) return 1;
  return value <= 0xffff ? 3 : 5;
}

constexpr std::size_t int_x_size(std::int32_t value) {
  if (value >= -128 && value < int_x_i16) return 1;
  return value >= -32768 && value <= 32767 ? 3 : 5;
}

/// Total of a structure whose size field is a uint_x that counts itself; `body` is everything but that field.
/// More than 2^32 - 1 means that it does not fit.
constexpr std::uint64_t with_uint_x_size(std::uint64_t body) {
  if (body <= 251) return body + 1;
  return body + (body <= 65532 ? 3 : 5);
}

}  // namespace rr
