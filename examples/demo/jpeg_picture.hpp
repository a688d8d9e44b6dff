// JPEG -> image. Layer: demo, pure. libjpeg-turbo stays behind this header.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "examples/demo/frame_source.hpp"

namespace rrgate::demo {

/// Decodes the picture that `bytes` begins with; one of a Motion JPEG stream may have no Huffman tables.
/// `used`    is set to where the picture ends in `bytes`; only where there is no problem.
/// Problems  no JPEG, one that is damaged or ends early, more than max_picture_bytes as an image (nothing allocated).
FrameResult decode_jpeg(std::span<const std::uint8_t> bytes, std::size_t* used = nullptr);

}  // namespace rrgate::demo
