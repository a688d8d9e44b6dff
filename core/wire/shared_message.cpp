#include "core/wire/shared_message.hpp"

#include "core/wire/encode_plan.hpp"

namespace rr {

Result<> SharedMessage::encode(const EncodeOptions& options, EncodedMessage& out) {
  const auto encoded = common(options);
  if (!encoded) return encoded.error();
  if (!*encoded) return rr::encode(message, options, out);
  out.assign(**encoded, message.header.message_id, own_number);
  return {};
}

Result<const EncodedMessage*> SharedMessage::lend(const EncodeOptions& options) {
  const auto encoded = common(options);
  if (!encoded) return encoded.error();
  if (*encoded) (*encoded)->address(message.header.message_id, own_number);
  return *encoded;
}

/// What receivers have in common. Null: this one is sent something else.
Result<EncodedMessage*> SharedMessage::common(const EncodeOptions& options) {
  const auto& header = message.header;
  if (header.version != 4 || header.has_routing || header.has_endpoints || header.message_id == 0) return nullptr;
  const auto mode = options.string_table;
  auto& encoded = encoded_[(mode.local ? 1u : 0u) + (mode.standard ? 2u : 0u)];
  if (encoded.size() == 0) {
    encoded.mark(own_number.data());
    if (auto done = rr::encode(message, options, encoded); !done) return done.error();
  } else if (auto checked = check_message_size(encoded.size(), options); !checked) {
    return checked.error();
  }
  return &encoded;
}

}  // namespace rr
