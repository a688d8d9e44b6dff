// The message versions we speak: a row a version. Layer: wire. Source: messages spec section 2.
#pragma once

#include <cstdint>
#include <span>

#include "core/wire/codec.hpp"

namespace rr {

/// What a version brings. Both functions may rely on the first ten bytes and the version having been checked.
struct Codec {
  std::uint16_t version;
  Result<> (*decode)(ByteSpan bytes, const DecodeOptions& options, Message& message);
  Result<> (*encode)(const Message& message, const EncodeOptions& options, EncodedMessage& out);
};

Result<> decode_v2(ByteSpan bytes, const DecodeOptions& options, Message& message);
Result<> encode_v2(const Message& message, const EncodeOptions& options, EncodedMessage& out);
Result<> decode_v4(ByteSpan bytes, const DecodeOptions& options, Message& message);
Result<> encode_v4(const Message& message, const EncodeOptions& options, EncodedMessage& out);

inline constexpr Codec codecs[] = {
    {2, decode_v2, encode_v2},
    {4, decode_v4, encode_v4},
};

/// nullptr when the version is not in the list.
constexpr const Codec* find_codec(std::uint16_t version) {
  for (const auto& codec : codecs)
    if (codec.version == version) return &codec;
  return nullptr;
}

}  // namespace rr
