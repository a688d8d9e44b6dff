// A message that many receivers are sent. Layer: wire.
#pragma once

#include <array>
#include <cstdint>

#include "core/wire/codec.hpp"
#include "core/wire/message.hpp"

namespace rr {

/// Encoded once for all receivers to whom it differs in nothing but MessageID and one number: those of version 4 who
/// are sent it without addresses. Build `message` first, then set its header to each receiver in turn.
class SharedMessage {
 public:
  Message message;
  /// The data of an element, which the owner of these bytes sets to each receiver in turn as well; empty: of none.
  ByteSpan own_number;

  /// Has `write(message)` fill in the message, unless that is done already; where it fails the message stays empty.
  template <class Write>
  Result<SharedMessage*> pack(Write&& write) {
    if (!message.entries.empty()) return this;
    if (auto written = write(message); !written) {
      message.clear();
      return written.error();
    }
    return this;
  }
  /// The same as encode() of `message`. Its entries and metadata stay as they are from the first call on.
  [[nodiscard]] Result<> encode(const EncodeOptions& options, EncodedMessage& out);
  /// The same without a copy: valid until the next of these calls. Null where the receiver needs one of its own.
  [[nodiscard]] Result<const EncodedMessage*> lend(const EncodeOptions& options);
  /// `message` may be changed again.
  void forget_encoded() { encoded_ = {}; }

 private:
  Result<EncodedMessage*> common(const EncodeOptions& options);

  std::array<EncodedMessage, 4> encoded_;  ///< by string table mode; empty while nobody needs it
};

}  // namespace rr
