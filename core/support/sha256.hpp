// SHA-256: names contents, so that equal names mean equal contents. Layer: support. Source: FIPS 180-4.
#pragma once

#include <array>
#include <cstdint>

#include "core/support/bytes.hpp"

namespace rr {

using Sha256 = std::array<std::uint8_t, 32>;

/// For short contents now and then: it makes one pass, and no use of what the processor has for it.
Sha256 sha256(ByteSpan content);

}  // namespace rr
