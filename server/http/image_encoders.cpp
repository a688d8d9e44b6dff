#include "server/http/image_encoders.hpp"

#include <zlib.h>

#include <csetjmp>
#include <cstdio>
#include <cstdlib>
#include <vector>

#include <jpeglib.h>  // wants FILE to be known

namespace rrgate {

namespace {

constexpr std::uint32_t max_side = 16384;
constexpr std::uint64_t max_pixels = 64u * 1024 * 1024;
constexpr int jpeg_quality = 85;

rr::Error not_encoded(std::string why) {
  return rr::make_error(rr::ErrorCode::operation_failed, "the image " + std::move(why));
}

void add_big_endian(std::string& out, std::uint32_t number) {
  for (int shift = 24; shift >= 0; shift -= 8) out += static_cast<char>(number >> shift);
}

void add_chunk(std::string& out, std::string_view type, std::string_view data) {
  add_big_endian(out, static_cast<std::uint32_t>(data.size()));
  const auto begin = out.size();
  out.append(type).append(data);
  const auto* covered = reinterpret_cast<const Bytef*>(out.data() + begin);
  add_big_endian(out, static_cast<std::uint32_t>(crc32(0, covered, static_cast<uInt>(out.size() - begin))));
}

/// A row as PNG has it: red before blue, 16 bits with the higher byte first.
void put_row(const std::uint8_t* from, std::uint32_t width, PixelFormat format, std::uint8_t* to) {
  const auto size = width * bytes_per_pixel(format);
  const bool swaps_colors = format == PixelFormat::bgr8 || format == PixelFormat::bgra8;
  const std::size_t group = bytes_per_pixel(format);
  const std::size_t other = swaps_colors ? 2 : format == PixelFormat::mono16 ? 1 : 0;
  std::copy_n(from, size, to);
  if (other != 0)
    for (std::size_t i = 0; i < size; i += group) std::swap(to[i], to[i + other]);
}

/// Filter "Sub": each byte less the one a pixel before it.
void filter_row(std::uint8_t* row, std::size_t size, std::size_t pixel) {
  for (std::size_t i = size; i-- > pixel;) row[i] = static_cast<std::uint8_t>(row[i] - row[i - pixel]);
}

struct JpegError {
  jpeg_error_mgr base;
  std::jmp_buf back;
  char text[JMSG_LENGTH_MAX];
};

void leave_jpeg(j_common_ptr info) {
  auto* error = reinterpret_cast<JpegError*>(info->err);
  info->err->format_message(info, error->text);
  std::longjmp(error->back, 1);
}

void keep_quiet(j_common_ptr, int) {}

/// libjpeg leaves this function by longjmp where it fails: nothing here has a destructor.
bool compress_jpeg(const std::uint8_t* first, std::size_t step, std::uint32_t width, std::uint32_t height,
                   J_COLOR_SPACE colors, int components, JpegError& error, unsigned char** out, unsigned long* size) {
  jpeg_compress_struct info;
  info.err = jpeg_std_error(&error.base);
  error.base.error_exit = leave_jpeg;
  error.base.emit_message = keep_quiet;
  if (setjmp(error.back) != 0) {
    jpeg_destroy_compress(&info);
    return false;
  }
  jpeg_create_compress(&info);
  jpeg_mem_dest(&info, out, size);
  info.image_width = width;
  info.image_height = height;
  info.input_components = components;
  info.in_color_space = colors;
  jpeg_set_defaults(&info);
  jpeg_set_quality(&info, jpeg_quality, TRUE);
  jpeg_start_compress(&info, TRUE);
  while (info.next_scanline < height) {
    JSAMPROW row = const_cast<JSAMPROW>(first + step * info.next_scanline);  // only read
    jpeg_write_scanlines(&info, &row, 1);
  }
  jpeg_finish_compress(&info);
  jpeg_destroy_compress(&info);
  return true;
}

J_COLOR_SPACE color_space(PixelFormat format) {
  switch (format) {
    case PixelFormat::rgb8:
      return JCS_EXT_RGB;
    case PixelFormat::bgr8:
      return JCS_EXT_BGR;
    case PixelFormat::rgba8:
      return JCS_EXT_RGBX;
    case PixelFormat::bgra8:
      return JCS_EXT_BGRX;
    default:
      return JCS_GRAYSCALE;
  }
}

}  // namespace

std::size_t bytes_per_pixel(PixelFormat format) {
  switch (format) {
    case PixelFormat::mono8:
      return 1;
    case PixelFormat::mono16:
      return 2;
    case PixelFormat::rgb8:
    case PixelFormat::bgr8:
      return 3;
    default:
      return 4;
  }
}

rr::Result<> check_image(const PixelImage& image) {
  const auto size = std::to_string(image.width) + " x " + std::to_string(image.height);
  if (image.width == 0 || image.height == 0 || image.width > max_side || image.height > max_side ||
      std::uint64_t{image.width} * image.height > max_pixels)
    return not_encoded("has " + size + " pixels, expected 1 to " + std::to_string(max_side) + " either way");
  const auto row = image.width * bytes_per_pixel(image.format);
  if (image.step < row)
    return not_encoded("has " + std::to_string(image.step) + " bytes a row, expected at least " + std::to_string(row));
  // Both factors have been bounded, the step by the data: nothing overflows.
  if (image.step > image.data.size() || image.step * (image.height - 1) + row > image.data.size())
    return not_encoded("has " + std::to_string(image.data.size()) + " bytes, too few for " + size + " pixels");
  if (image.data.size() > image.step * image.height)  // other pixels than it says
    return not_encoded("has " + std::to_string(image.data.size()) + " bytes, too many for " + size + " pixels");
  return {};
}

rr::Result<std::string> encode_png(const PixelImage& image) {
  const auto pixel = bytes_per_pixel(image.format);
  const auto row_bytes = image.width * pixel;
  std::vector<std::uint8_t> rows((row_bytes + 1) * image.height);
  for (std::uint32_t i = 0; i < image.height; ++i) {
    auto* row = rows.data() + (row_bytes + 1) * i;
    row[0] = 1;  // filter "Sub"
    put_row(image.data.data() + image.step * i, image.width, image.format, row + 1);
    filter_row(row + 1, row_bytes, pixel);
  }
  auto size = compressBound(static_cast<uLong>(rows.size()));
  std::string packed(size, '\0');
  if (compress2(reinterpret_cast<Bytef*>(packed.data()), &size, rows.data(), static_cast<uLong>(rows.size()),
                Z_BEST_SPEED) != Z_OK)
    return not_encoded("could not be compressed");
  packed.resize(size);

  constexpr char gray = 0, rgb = 2, rgba = 6;
  std::string header;
  add_big_endian(header, image.width);
  add_big_endian(header, image.height);
  header += image.format == PixelFormat::mono16 ? '\x10' : '\x08';
  header += pixel <= 2 ? gray : pixel == 3 ? rgb : rgba;
  header.append(3, '\0');  // deflate, the usual filters, not interlaced
  std::string out("\x89PNG\r\n\x1a\n");
  add_chunk(out, "IHDR", header);
  add_chunk(out, "IDAT", packed);
  add_chunk(out, "IEND", {});
  return out;
}

rr::Result<std::string> encode_jpeg(const PixelImage& image) {
  rr::Bytes high;  // of mono16
  const auto* first = image.data.data();
  auto step = image.step;
  if (image.format == PixelFormat::mono16) {
    high.resize(std::size_t{image.width} * image.height);
    for (std::size_t i = 0; i < high.size(); ++i)
      high[i] = image.data[image.step * (i / image.width) + 2 * (i % image.width) + 1];
    first = high.data();
    step = image.width;
  }
  const int components = image.format == PixelFormat::mono16 ? 1 : static_cast<int>(bytes_per_pixel(image.format));
  JpegError error{};
  unsigned char* bytes = nullptr;
  unsigned long size = 0;
  const bool is_done = compress_jpeg(first, step, image.width, image.height, color_space(image.format), components,
                                     error, &bytes, &size);
  auto out = is_done ? rr::Result<std::string>(std::string(reinterpret_cast<const char*>(bytes), size))
                     : rr::Result<std::string>(not_encoded("could not be compressed: " + std::string(error.text)));
  std::free(bytes);  // libjpeg's, from malloc()
  return out;
}

}  // namespace rrgate
