#include "core/wire/codec.hpp"

#include <algorithm>
#include <cstring>
#include <limits>
#include <string>

#include "core/wire/codec_list.hpp"
#include "core/wire/frame_start.hpp"

namespace rr {

Result<> decode(ByteSpan bytes, const DecodeOptions& options, Message& message) {
  message.clear();
  const auto start = bytes.first(std::min(bytes.size(), frame_start_size));
  if (auto checked = check_frame_start(start, std::numeric_limits<std::size_t>::max()); !checked) return checked;
  if (start.size() < frame_start_size)
    return make_error(ErrorCode::connection_error,
                      "header at byte " + std::to_string(bytes.size()) + ": the input ends inside the first ten bytes");
  const std::size_t size = frame_message_size(bytes);
  if (size > bytes.size())
    return make_error(ErrorCode::connection_error, "MessageSize at byte 4: " + std::to_string(size) +
                                                       " bytes, but the input ends after " +
                                                       std::to_string(bytes.size()));
  if (size < bytes.size())
    return protocol_error("MessageSize at byte 4: " + std::to_string(size) + " bytes, but the input has " +
                          std::to_string(bytes.size()));
  auto decoded = find_codec(frame_version(bytes))->decode(bytes, options, message);
  if (!decoded) message.clear();
  return decoded;
}

Result<> encode(const Message& message, const EncodeOptions& options, EncodedMessage& out) {
  const Codec* codec = find_codec(message.header.version);
  auto encoded = codec != nullptr ? codec->encode(message, options, out)
                                  : protocol_error("encode: message version " + std::to_string(message.header.version) +
                                                   " is not known, expected 2 or 4");
  if (!encoded) out.clear();
  return encoded;
}

Bytes EncodedMessage::to_bytes() const {
  Bytes bytes;
  bytes.reserve(size_);
  for (const auto slice : slices_) bytes.insert(bytes.end(), slice.begin(), slice.end());
  return bytes;
}

void EncodedMessage::assign(const EncodedMessage& other, std::uint16_t message_id, ByteSpan marked) {
  size_ = other.size_;
  scratch_ = other.scratch_;
  slices_ = other.slices_;
  owners_ = other.owners_;
  message_id_at_ = other.message_id_at_;
  marked_at_ = other.marked_at_;
  address(message_id, marked);
  std::size_t at = 0;
  for (auto& slice : slices_) {
    if (slice.data() != other.scratch_.data() + at) continue;  // a payload
    slice = {scratch_.data() + at, slice.size()};
    at += slice.size();
  }
}

void EncodedMessage::address(std::uint16_t message_id, ByteSpan marked) {
  std::memcpy(scratch_.data() + message_id_at_, &message_id, sizeof(message_id));
  if (!marked.empty()) std::memcpy(scratch_.data() + marked_at_, marked.data(), marked.size());
}

void EncodedMessage::clear() {
  size_ = 0;
  clear_kept(slices_);
  clear_kept(owners_);
  if (scratch_.capacity() > max_kept_bytes) scratch_ = Bytes();  // a small one keeps its size: it is written over
  clear_kept(plan_.entries);
  clear_kept(plan_.elements);
}

}  // namespace rr
