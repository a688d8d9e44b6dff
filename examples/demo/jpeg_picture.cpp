#include "examples/demo/jpeg_picture.hpp"

#include <csetjmp>
#include <cstdio>
#include <string>

#include <jpeglib.h>  // wants FILE to be known

#include <jerror.h>

#include "examples/demo/raw_frame.hpp"

namespace rrgate::demo {

namespace {

/// A progressive picture has about ten; one with thousands is made to keep its decoder busy.
constexpr int max_jpeg_scans = 100;

struct JpegReader {
  jpeg_error_mgr errors;
  jpeg_progress_mgr progress;
  std::jmp_buf back;
  char text[JMSG_LENGTH_MAX];
  jpeg_decompress_struct info;
};

JpegReader& reader_of(j_common_ptr info) {
  return *static_cast<JpegReader*>(info->client_data);
}

void leave_jpeg_reader(j_common_ptr info) {
  info->err->format_message(info, reader_of(info).text);
  std::longjmp(reader_of(info).back, 1);
}

/// libjpeg itself only warns of a picture that ends early, and makes the rest of it grey.
void judge_jpeg_warning(j_common_ptr info, int) {
  if (info->err->msg_code == JWRN_JPEG_EOF) leave_jpeg_reader(info);
}

void count_jpeg_scans(j_common_ptr info) {
  if (reader_of(info).info.input_scan_number <= max_jpeg_scans) return;
  std::snprintf(reader_of(info).text, JMSG_LENGTH_MAX, "more than %d scans", max_jpeg_scans);
  std::longjmp(reader_of(info).back, 1);
}

// libjpeg leaves these two by longjmp where it fails: nothing in them has a destructor.

bool read_jpeg_header(JpegReader& reader, const std::uint8_t* data, std::size_t size) {
  if (setjmp(reader.back) != 0) return false;
  jpeg_create_decompress(&reader.info);
  reader.info.client_data = &reader;
  reader.info.progress = &reader.progress;
  jpeg_mem_src(&reader.info, data, static_cast<unsigned long>(size));
  jpeg_read_header(&reader.info, TRUE);
  reader.info.out_color_space = JCS_EXT_BGR;
  return true;
}

bool read_jpeg_rows(JpegReader& reader, std::uint8_t* rows, std::size_t step) {
  if (setjmp(reader.back) != 0) return false;
  jpeg_start_decompress(&reader.info);
  while (reader.info.output_scanline < reader.info.output_height) {
    JSAMPROW row = rows + step * reader.info.output_scanline;
    jpeg_read_scanlines(&reader.info, &row, 1);
  }
  jpeg_finish_decompress(&reader.info);
  return true;
}

FrameResult decode_with(JpegReader& reader, std::span<const std::uint8_t> bytes, std::size_t* used) {
  const auto failed = [&reader] { return FrameResult{{}, "a JPEG can't be decoded: " + std::string(reader.text)}; };
  if (!read_jpeg_header(reader, bytes.data(), bytes.size())) return failed();
  if (auto problem = check_layout({RawFormat::mjpeg, reader.info.image_width, reader.info.image_height, 0});
      !problem.empty())
    return {{}, std::move(problem)};
  Image image;
  image.width = static_cast<int>(reader.info.image_width);
  image.height = static_cast<int>(reader.info.image_height);
  image.step = image.width * 3;
  image.data.resize(static_cast<std::size_t>(image.step) * static_cast<std::size_t>(image.height));
  if (!read_jpeg_rows(reader, image.data.data(), static_cast<std::size_t>(image.step))) return failed();
  if (used) *used = bytes.size() - reader.info.src->bytes_in_buffer;
  return {std::move(image), {}};
}

}  // namespace

FrameResult decode_jpeg(std::span<const std::uint8_t> bytes, std::size_t* used) {
  if (bytes.size() < 2 || bytes[0] != 0xff || bytes[1] != 0xd8)
    return {{}, "a JPEG begins with other bytes than FF D8, or is empty"};
  JpegReader reader{};
  reader.info.err = jpeg_std_error(&reader.errors);
  reader.info.client_data = &reader;  // libjpeg keeps it when it clears the rest
  reader.errors.error_exit = leave_jpeg_reader;
  reader.errors.emit_message = judge_jpeg_warning;
  reader.progress.progress_monitor = count_jpeg_scans;
  auto result = decode_with(reader, bytes, used);
  jpeg_destroy_decompress(&reader.info);
  return result;
}

}  // namespace rrgate::demo
