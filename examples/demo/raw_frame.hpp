// Frames as cameras deliver them, and their conversion to the image of the service. Layer: demo, pure.
// Source: Linux media documentation, "Image Formats" (V4L2_PIX_FMT_YUYV, BGR24, RGB24, GREY, MJPEG).
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>

#include "examples/demo/frame_source.hpp"

namespace rrgate::demo {

enum class RawFormat { yuyv, bgr24, rgb24, grey, mjpeg };

std::string_view to_text(RawFormat format);

/// How the pixels of a frame lie in its bytes.
struct RawLayout {
  RawFormat format = RawFormat::yuyv;
  std::uint32_t width = 0;  ///< even for yuyv, where two pixels share their colour
  std::uint32_t height = 0;
  std::uint32_t step = 0;  ///< bytes from one row to the next; not used for mjpeg
};

/// Largest frame of a driver, and the largest side of a picture.
inline constexpr std::uint64_t max_raw_bytes = 64u * 1024 * 1024;
inline constexpr std::uint32_t max_picture_side = 16384;

/// Returns a sentence about what is wrong with the size; empty where nothing is.
std::string check_layout(const RawLayout& layout);

/// How many bytes a frame has at least; 1 for mjpeg. `layout` was checked, or nothing is promised about the number.
std::uint64_t needed_bytes(const RawLayout& layout);

struct RawFrame {
  RawLayout layout;
  std::span<const std::uint8_t> bytes;  ///< borrowed
};

/// Problems: a layout that check_layout() refuses, too few bytes, mjpeg (decode_jpeg() takes that).
FrameResult to_image(const RawFrame& frame);

}  // namespace rrgate::demo
