#include "examples/demo/raw_frame.hpp"

#include <algorithm>

namespace rrgate::demo {

namespace {

std::uint32_t raw_bytes_per_pixel(RawFormat format) {
  switch (format) {
    case RawFormat::yuyv:
      return 2;
    case RawFormat::bgr24:
    case RawFormat::rgb24:
      return 3;
    default:
      return 1;
  }
}

std::uint8_t clamp_channel(int value) {
  return static_cast<std::uint8_t>(std::clamp(value, 0, 255));
}

/// ITU-R BT.601 with 16..235 for luma, which V4L2 means where a driver names no other; in 1/256.
void put_yuv(int y, int u, int v, std::uint8_t* bgr) {
  const int luma = 298 * (y - 16) + 128;
  u -= 128;
  v -= 128;
  bgr[0] = clamp_channel((luma + 516 * u) >> 8);
  bgr[1] = clamp_channel((luma - 100 * u - 208 * v) >> 8);
  bgr[2] = clamp_channel((luma + 409 * v) >> 8);
}

void convert_row(const std::uint8_t* from, std::uint32_t width, RawFormat format, std::uint8_t* bgr) {
  switch (format) {
    case RawFormat::yuyv:
      for (std::uint32_t i = 0; i < width; i += 2, from += 4, bgr += 6) {
        put_yuv(from[0], from[1], from[3], bgr);
        put_yuv(from[2], from[1], from[3], bgr + 3);
      }
      return;
    case RawFormat::rgb24:
      for (std::uint32_t i = 0; i < width; ++i, from += 3, bgr += 3) std::reverse_copy(from, from + 3, bgr);
      return;
    case RawFormat::grey:
      for (std::uint32_t i = 0; i < width; ++i, bgr += 3) std::fill_n(bgr, 3, from[i]);
      return;
    default:
      std::copy_n(from, std::size_t{width} * 3, bgr);
  }
}

std::string size_text(const RawLayout& layout) {
  return std::to_string(layout.width) + " x " + std::to_string(layout.height) + " pixels";
}

}  // namespace

std::string_view to_text(RawFormat format) {
  switch (format) {
    case RawFormat::yuyv:
      return "YUYV";
    case RawFormat::bgr24:
      return "BGR24";
    case RawFormat::rgb24:
      return "RGB24";
    case RawFormat::grey:
      return "GREY";
    default:
      return "MJPEG";
  }
}

std::string check_layout(const RawLayout& layout) {
  if (layout.width == 0 || layout.height == 0 || layout.width > max_picture_side || layout.height > max_picture_side)
    return "a picture has " + size_text(layout) + ", expected 1 to " + std::to_string(max_picture_side) + " either way";
  if (const auto bytes = std::uint64_t{layout.width} * layout.height * 3; bytes > max_picture_bytes)
    return "a picture of " + size_text(layout) + " has " + std::to_string(bytes) + " bytes, expected at most " +
           std::to_string(max_picture_bytes);
  if (layout.format == RawFormat::mjpeg) return {};
  if (layout.format == RawFormat::yuyv && layout.width % 2 != 0)
    return "a YUYV picture has " + size_text(layout) + ", expected an even width";
  if (const auto row = layout.width * raw_bytes_per_pixel(layout.format); layout.step < row)
    return "a row has " + std::to_string(layout.step) + " bytes, expected at least " + std::to_string(row);
  if (const auto bytes = needed_bytes(layout); bytes > max_raw_bytes)
    return "a frame has " + std::to_string(bytes) + " bytes, expected at most " + std::to_string(max_raw_bytes);
  return {};
}

std::uint64_t needed_bytes(const RawLayout& layout) {
  if (layout.format == RawFormat::mjpeg) return 1;
  return std::uint64_t{layout.step} * (layout.height - 1) +
         std::uint64_t{layout.width} * raw_bytes_per_pixel(layout.format);  // the last row may end early
}

FrameResult to_image(const RawFrame& frame) {
  const auto& layout = frame.layout;
  if (layout.format == RawFormat::mjpeg) return {{}, "a frame of the format MJPEG has no rows to convert"};
  if (auto problem = check_layout(layout); !problem.empty()) return {{}, std::move(problem)};
  if (frame.bytes.size() < needed_bytes(layout))
    return {{},
            "a frame has " + std::to_string(frame.bytes.size()) + " bytes, expected " +
                std::to_string(needed_bytes(layout)) + " for " + size_text(layout)};
  Image image;
  image.width = static_cast<int>(layout.width);
  image.height = static_cast<int>(layout.height);
  image.step = image.width * 3;
  image.data.resize(std::size_t{layout.width} * layout.height * 3);
  for (std::size_t row = 0; row < layout.height; ++row)
    convert_row(frame.bytes.data() + row * layout.step, layout.width, layout.format,
                image.data.data() + row * static_cast<std::size_t>(image.step));
  return {std::move(image), {}};
}

}  // namespace rrgate::demo
