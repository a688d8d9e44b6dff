#include "server/http/endpoints/image_values.hpp"

#include <algorithm>
#include <optional>

namespace rrgate {

namespace {

using rr::MemberDefinition;

const rr::EntityDefinition* find_structure(const rr::TypeDefinition& type, const rr::TypeRegistry& types) {
  if (type.array != rr::ArrayKind::none ||
      (type.container != rr::ContainerKind::none && type.container != rr::ContainerKind::generator))
    return nullptr;
  const auto* entity = types.find_entity(type.qualified_name);
  return entity && entity->kind == rr::EntityKind::structure ? entity : nullptr;
}

bool is_bytes(const MemberDefinition* field) {
  return field && field->type.type == rr::DataType::uint8_t && field->type.array == rr::ArrayKind::variable &&
         field->type.container == rr::ContainerKind::none;
}

/// The structure that says how large the image is: the whole, or its image_info.
const rr::EntityDefinition* find_description(const rr::EntityDefinition& image, const rr::TypeRegistry& types) {
  const auto has_sizes = [](const rr::EntityDefinition& entity) {
    const auto is_number = [&](const char* name) {
      const auto* field = entity.find_member(name);
      return field && field->type.array == rr::ArrayKind::none && rr::item_size(field->type.type) > 0;
    };
    return is_number("width") && is_number("height");
  };
  if (has_sizes(image)) return &image;
  const auto* info = image.find_member("image_info");
  const auto* entity = info ? find_structure(info->type, types) : nullptr;
  return entity && has_sizes(*entity) ? entity : nullptr;
}

rr::Error no_image(std::string why) {
  return rr::make_error(rr::ErrorCode::operation_failed, "the image " + std::move(why));
}

/// "BGR_888" and "bgr888" are the same.
std::string plain(std::string_view text) {
  std::string out;
  for (const char c : text)
    if (c != '_' && c != '-' && c != ' ') out += static_cast<char>(c >= 'A' && c <= 'Z' ? c + ('a' - 'A') : c);
  return out;
}

/// What `encoding` or `format` says: text, or an enum's word. Empty: nothing.
std::string encoding_of(const rr::Structure& info, const rr::EntityDefinition& type, const rr::TypeRegistry& types) {
  for (const char* name : {"encoding", "format"}) {
    const auto* value = info.find(name);
    const auto* field = type.find_member(name);
    if (!value || !field) continue;
    if (const auto text = value->to_text()) return plain(*text);
    const auto* words = types.find_enum(field->type.qualified_name);
    const auto number = value->to<std::int32_t>();
    if (!words || !number) continue;
    for (const auto& word : words->values)
      if (word.value == *number) return plain(word.name);
  }
  return {};
}

std::optional<PixelFormat> format_of(std::string_view encoding) {
  using enum PixelFormat;
  static constexpr std::pair<std::string_view, PixelFormat> names[] = {
      {"mono8", mono8},  {"gray8", mono8}, {"grey8", mono8},    {"mono16", mono16},
      {"rgb8", rgb8},    {"rgb888", rgb8}, {"rgb24", rgb8},     {"bgr8", bgr8},
      {"bgr888", bgr8},  {"bgr24", bgr8},  {"rgba8", rgba8},    {"rgba8888", rgba8},
      {"rgba32", rgba8}, {"bgra8", bgra8}, {"bgra8888", bgra8}, {"bgra32", bgra8}};
  for (const auto& [name, format] : names)
    if (name == encoding) return format;
  return std::nullopt;
}

/// A structure without a word for it: what the webcams of Robot Raconteur's examples send, blue first.
std::optional<PixelFormat> format_by_size(std::uint64_t bytes_a_pixel) {
  switch (bytes_a_pixel) {
    case 1:
      return PixelFormat::mono8;
    case 3:
      return PixelFormat::bgr8;
    case 4:
      return PixelFormat::bgra8;
    default:
      return std::nullopt;
  }
}

}  // namespace

bool is_image_type(const rr::TypeDefinition& type, const rr::TypeRegistry& types) {
  const auto* image = find_structure(type, types);
  return image && is_bytes(image->find_member("data")) && find_description(*image, types);
}

rr::Result<ImageWork> prepare_image(const rr::Value& value, const rr::TypeDefinition& type,
                                    const rr::TypeRegistry& types, std::string_view media_type) {
  const auto* image_type = find_structure(type, types);
  const auto* image = value.get_if<rr::Structure>();
  if (!image || !image_type) return no_image("is null");
  const auto* data = image->find("data");
  const auto* array = data ? data->get_if<rr::Array>() : nullptr;
  if (!array) return no_image("has no data");
  const auto* info_type = find_description(*image_type, types);
  const auto* inner = info_type == image_type ? nullptr : image->find("image_info");
  const auto* info = inner ? inner->get_if<rr::Structure>() : image;
  if (!info) return no_image("has no image_info");
  ImageWork work{{}, *array, {}, media_type};
  const auto bytes = work.data.bytes();
  const auto text = rr::as_text(bytes);

  const auto encoding = encoding_of(*info, *info_type, types);
  const auto format = format_of(encoding);
  if (!format) {
    const std::string_view found = text.starts_with("\xff\xd8\xff") ? jpeg_type
                                   : text.starts_with("\x89PNG")    ? png_type
                                                                    : "";
    if (found == media_type) {
      work.ready = text;
      return work;
    }
    if (!found.empty()) return no_image("is " + std::string(found) + "; ask for that");
    if (!encoding.empty()) return no_image("is encoded as " + rr::quote(encoding) + ", which is not known here");
  }
  const auto number = [&](const char* name) -> std::uint64_t {
    const auto* field = info->find(name);
    const auto read = field ? field->to<std::int64_t>() : rr::Result<std::int64_t>(0);
    return read && *read > 0 && *read <= UINT32_MAX ? static_cast<std::uint64_t>(*read) : 0;
  };
  auto& pixels = work.pixels;
  pixels.width = static_cast<std::uint32_t>(number("width"));
  pixels.height = static_cast<std::uint32_t>(number("height"));
  pixels.data = bytes;
  const auto step = number("step");
  const auto by_size = format_by_size(pixels.width == 0    ? 0
                                      : step > 0           ? step / pixels.width
                                      : pixels.height == 0 ? 0
                                                           : bytes.size() / pixels.width / pixels.height);
  if (!format && !by_size)
    return no_image("has " + std::to_string(pixels.width) + " x " + std::to_string(pixels.height) + " pixels in " +
                    std::to_string(bytes.size()) + " bytes and does not say how");
  pixels.format = format ? *format : *by_size;
  pixels.step = step > 0 ? static_cast<std::size_t>(step) : pixels.width * bytes_per_pixel(pixels.format);
  if (const auto checked = check_image(pixels); !checked) return checked.error();
  return work;
}

rr::Result<std::string> encode_image(const ImageWork& work) {
  if (!work.ready.empty()) return work.ready;
  return work.media_type == png_type ? encode_png(work.pixels) : encode_jpeg(work.pixels);
}

}  // namespace rrgate
