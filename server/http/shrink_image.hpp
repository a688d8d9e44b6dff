// Fewer pixels of the same image. Layer: server/http.
#pragma once

#include "server/http/image_encoders.hpp"

namespace rrgate {

struct ShrunkImage {
  rr::Bytes pixels;
  PixelImage image;  ///< of them; mono16 has become mono8
};

/// At most `longest` pixels either way, each the mean of a square of the old ones. For any thread.
/// `image`  has passed check_image().
ShrunkImage shrink_image(const PixelImage& image, std::uint32_t longest);

}  // namespace rrgate
