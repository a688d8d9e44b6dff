#include "server/http/shrink_image.hpp"

#include <algorithm>

namespace rrgate {

ShrunkImage shrink_image(const PixelImage& image, std::uint32_t longest) {
  const bool is_mono16 = image.format == PixelFormat::mono16;
  const auto from_bytes = bytes_per_pixel(image.format);
  const auto to_bytes = is_mono16 ? 1 : from_bytes;
  const auto first_byte = from_bytes - to_bytes;  // of mono16 the higher one
  const auto side = (std::max(image.width, image.height) + longest - 1) / longest;
  ShrunkImage out;
  out.image.format = is_mono16 ? PixelFormat::mono8 : image.format;
  out.image.width = (image.width + side - 1) / side;
  out.image.height = (image.height + side - 1) / side;
  out.image.step = out.image.width * to_bytes;
  out.pixels.reserve(out.image.step * out.image.height);
  for (std::uint32_t row = 0; row < image.height; row += side)
    for (std::uint32_t column = 0; column < image.width; column += side) {
      const auto rows = std::min(side, image.height - row);
      const auto columns = std::min(side, image.width - column);
      for (std::size_t byte = first_byte; byte < from_bytes; ++byte) {
        std::uint64_t sum = 0;
        for (std::uint32_t y = row; y < row + rows; ++y)
          for (std::uint32_t x = column; x < column + columns; ++x)
            sum += image.data[y * image.step + x * from_bytes + byte];
        out.pixels.push_back(static_cast<std::uint8_t>(sum / (std::uint64_t{rows} * columns)));
      }
    }
  out.image.data = out.pixels;
  return out;
}

}  // namespace rrgate
