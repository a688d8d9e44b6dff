// CBOR tags of number arrays. Layer: server/json. Source: RFC 8746 section 2.1.
#pragma once

#include <cstdint>
#include <optional>

#include "core/wire/message.hpp"

namespace rr {

/// Of little-endian items; nullopt for types that have none (complex numbers, bool).
constexpr std::optional<std::uint64_t> typed_array_tag(DataType type) {
  switch (type) {
    case DataType::uint8_t:
      return 64;
    case DataType::uint16_t:
      return 69;
    case DataType::uint32_t:
      return 70;
    case DataType::uint64_t:
      return 71;
    case DataType::int8_t:
      return 72;
    case DataType::int16_t:
      return 77;
    case DataType::int32_t:
      return 78;
    case DataType::int64_t:
      return 79;
    case DataType::single_t:
      return 85;
    case DataType::double_t:
      return 86;
    default:
      return std::nullopt;
  }
}

}  // namespace rr
