// Frames out of files: the JPEG pictures of a folder, or a Motion JPEG stream. Layer: demo.
#pragma once

#include <memory>
#include <string>

#include "examples/demo/frame_source.hpp"

namespace rrgate::demo {

/// A folder with .jpg and .jpeg files (in the order of their names, 10,000 at most, 64 MB each), one such file, or a
/// .mjpeg file (256 MB at most). Each request takes the next picture, and the first after the last.
/// Returns  null with a sentence in `problem` where there is nothing of that, or its first picture can't be decoded.
std::unique_ptr<FrameSource> open_picture_files(const std::string& path, std::string& problem);

}  // namespace rrgate::demo
