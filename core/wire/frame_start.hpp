// The ten bytes that begin a message of any version. Layer: wire. Source: messages spec section 2.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string_view>

#include "core/support/bytes.hpp"
#include "core/support/error.hpp"

namespace rr {

inline constexpr std::string_view frame_magic = "RRAC";
inline constexpr std::size_t frame_start_size = 10;  ///< magic, MessageSize u32, version u16
inline constexpr std::size_t min_message_size = 16;  ///< 1.2.8 waits for 16 bytes before it looks at a message

/// MessageSize; `start` holds at least 8 bytes.
inline std::uint32_t frame_message_size(ByteSpan start) {
  return load<std::uint32_t>(start.data() + 4);
}
/// Version; `start` holds at least 10 bytes.
inline std::uint16_t frame_version(ByteSpan start) {
  return load<std::uint16_t>(start.data() + 8);
}

/// Checks as much of the first ten bytes as `start` holds, so that a wrong stream is refused at its first wrong byte.
/// Errors   protocol_error: magic, MessageSize below 16 or above `limit`, version that no codec knows.
Result<> check_frame_start(ByteSpan start, std::size_t limit);

}  // namespace rr
