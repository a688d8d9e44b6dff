// Values that are images, as browsers show them. Layer: server/http/endpoints. See docs/http-api.md.
#pragma once

#include <string>
#include <string_view>

#include "core/types/type_registry.hpp"
#include "core/types/value.hpp"
#include "server/http/image_encoders.hpp"

namespace rrgate {

inline constexpr std::string_view png_type = "image/png";
inline constexpr std::string_view jpeg_type = "image/jpeg";

/// Whether values of the type are images: a structure with `data` (uint8[]), `width` and `height`, these either in it
/// or in a structure `image_info` within it (com.robotraconteur.image).
bool is_image_type(const rr::TypeDefinition& type, const rr::TypeRegistry& types);

/// An image of a value: as it is, or its pixels.
struct ImageWork {
  std::string ready;  ///< not empty: of the wanted type already
  rr::Array data;     ///< keeps the pixels
  PixelImage pixels;
  std::string_view media_type;
};

/// `value`  of such a type.
/// Errors   operation_failed: sizes that don't fit, an encoding that is none of ours, compressed as something else.
rr::Result<ImageWork> prepare_image(const rr::Value& value, const rr::TypeDefinition& type,
                                    const rr::TypeRegistry& types, std::string_view media_type);
/// Takes a tenth of a second for a large one, on any thread. Errors   those of the encoders.
rr::Result<std::string> encode_image(const ImageWork& work);

}  // namespace rrgate
