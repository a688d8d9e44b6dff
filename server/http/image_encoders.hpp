// Pixels -> PNG and JPEG. Layer: server/http. zlib and libjpeg-turbo stay behind this header.
// Source: PNG (RFC 2083) sections 3, 4 and 6; ITU T.81 by libjpeg-turbo.
#pragma once

#include <cstdint>
#include <string>

#include "core/support/bytes.hpp"
#include "core/support/error.hpp"

namespace rrgate {

enum class PixelFormat : std::uint8_t { mono8, mono16, rgb8, bgr8, rgba8, bgra8 };

std::size_t bytes_per_pixel(PixelFormat format);

/// Rows from top to bottom; mono16 is little-endian. Borrowed.
struct PixelImage {
  std::uint32_t width = 0;
  std::uint32_t height = 0;
  std::size_t step = 0;  ///< bytes from one row to the next
  PixelFormat format = PixelFormat::mono8;
  rr::ByteSpan data;
};

/// What both encoders take: 1..16384 pixels either way, at most 64 million in all, data for all rows.
/// Errors   operation_failed.
rr::Result<> check_image(const PixelImage& image);

// `image`  has passed check_image(). Errors   operation_failed: the library's.
rr::Result<std::string> encode_png(const PixelImage& image);
/// mono16 keeps its higher byte, alpha is left out.
rr::Result<std::string> encode_jpeg(const PixelImage& image);

}  // namespace rrgate
