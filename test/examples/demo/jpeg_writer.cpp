#include "test/examples/demo/jpeg_writer.hpp"

#include <cstdio>
#include <cstdlib>

#include <jpeglib.h>  // wants FILE to be known

namespace rrgate::demo {

std::vector<std::uint8_t> make_jpeg(unsigned width, unsigned height, Color color, bool is_progressive) {
  std::vector<std::uint8_t> row;
  for (unsigned i = 0; i < width; ++i) row.insert(row.end(), {color.red, color.green, color.blue});
  jpeg_compress_struct info;
  jpeg_error_mgr errors;
  info.err = jpeg_std_error(&errors);  // ends the program: a test has asked for what is no picture
  jpeg_create_compress(&info);
  unsigned char* data = nullptr;
  unsigned long size = 0;
  jpeg_mem_dest(&info, &data, &size);
  info.image_width = width;
  info.image_height = height;
  info.input_components = 3;
  info.in_color_space = JCS_RGB;
  jpeg_set_defaults(&info);
  if (is_progressive) jpeg_simple_progression(&info);
  jpeg_start_compress(&info, TRUE);
  for (unsigned i = 0; i < height; ++i) {
    JSAMPROW rows = row.data();
    jpeg_write_scanlines(&info, &rows, 1);
  }
  jpeg_finish_compress(&info);
  jpeg_destroy_compress(&info);
  std::vector<std::uint8_t> jpeg(data, data + size);
  std::free(data);
  return jpeg;
}

}  // namespace rrgate::demo
