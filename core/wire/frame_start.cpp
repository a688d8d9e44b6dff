#include "core/wire/frame_start.hpp"

#include <algorithm>
#include <string>

#include "core/wire/codec_list.hpp"

namespace rr {

Result<> check_frame_start(ByteSpan start, std::size_t limit) {
  const auto magic = as_text(start.first(std::min(start.size(), frame_magic.size())));
  if (magic != frame_magic.substr(0, magic.size()))
    return protocol_error("magic at byte 0: found " + quote(magic) + ", expected 'RRAC'");
  if (start.size() < 8) return {};
  const auto size = frame_message_size(start);
  if (size < min_message_size)
    return protocol_error("MessageSize at byte 4: " + std::to_string(size) + " is below the minimum of " +
                          std::to_string(min_message_size));
  if (size > limit)
    return protocol_error("MessageSize at byte 4: " + std::to_string(size) + " is above the limit of " +
                          std::to_string(limit));
  if (start.size() < frame_start_size) return {};
  if (const auto version = frame_version(start); find_codec(version) == nullptr)
    return protocol_error("version at byte 8: found " + std::to_string(version) + ", expected 2 or 4");
  return {};
}

}  // namespace rr
