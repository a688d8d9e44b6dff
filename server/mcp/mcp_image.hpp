// Values that are images, as models look at them. Layer: server/mcp. See docs/mcp.md.
#pragma once

#include <string>

#include "server/http/endpoints/image_values.hpp"

namespace rrgate {

/// What models see of an image; more pixels cost them more and show no more.
inline constexpr std::uint32_t longest_side = 1024;
inline constexpr std::size_t largest_image = 256u * 1024;

struct McpImage {
  std::string_view media_type;
  std::string bytes;
  std::uint32_t width = 0;  ///< 0: it came compressed from the device, and nobody has looked into it
  std::uint32_t height = 0;
};

/// As JPEG within both bounds; as the device has compressed it, where that fits. For any thread.
/// Errors   operation_failed: of the encoder; compressed and too large.
rr::Result<McpImage> make_mcp_image(const ImageWork& work);

/// The same from a value of an image type. Errors   those of prepare_image().
rr::Result<ImageWork> prepare_mcp_image(const rr::Value& value, const rr::TypeDefinition& type,
                                        const rr::TypeRegistry& types);

}  // namespace rrgate
