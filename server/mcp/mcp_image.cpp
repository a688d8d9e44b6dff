#include "server/mcp/mcp_image.hpp"

#include "server/http/shrink_image.hpp"

namespace rrgate {

rr::Result<ImageWork> prepare_mcp_image(const rr::Value& value, const rr::TypeDefinition& type,
                                        const rr::TypeRegistry& types) {
  auto work = prepare_image(value, type, types, jpeg_type);
  if (work) return work;
  auto as_png = prepare_image(value, type, types, png_type);
  return as_png && !as_png->ready.empty() ? std::move(as_png) : std::move(work);
}

rr::Result<McpImage> make_mcp_image(const ImageWork& work) {
  McpImage out;
  out.media_type = work.media_type;
  if (!work.ready.empty()) {
    if (work.ready.size() > largest_image)
      return rr::make_error(rr::ErrorCode::operation_failed,
                            "the image is compressed by the device and has " + std::to_string(work.ready.size()) +
                                " bytes, which is more than " + std::to_string(largest_image) +
                                "; it is there by REST");
    out.bytes = work.ready;
    return out;
  }
  // Noise of that size compresses badly: then fewer pixels.
  for (auto side = longest_side; side > 0; side /= 2) {
    const auto small = shrink_image(work.pixels, side);
    auto bytes = encode_jpeg(small.image);
    if (!bytes) return bytes.error();
    out.width = small.image.width;
    out.height = small.image.height;
    out.bytes = std::move(*bytes);
    if (out.bytes.size() <= largest_image) break;
  }
  return out;
}

}  // namespace rrgate
