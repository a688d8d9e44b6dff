// Bytes of one message <-> Message, for versions 2 and 4. Layer: wire. Source: messages spec sections 1..8, 11, 14.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include "core/support/bytes.hpp"
#include "core/support/error.hpp"
#include "core/wire/message.hpp"

namespace rr {

/// What the two sides agreed on in CreateConnection (page 0x04100000).
struct StringTableMode {
  bool local = false;     ///< per-message table in the header
  bool standard = false;  ///< the standard table
  bool is_active() const { return local || standard; }
  bool operator==(const StringTableMode&) const = default;
};

struct DecodeOptions {
  StringTableMode string_table = {};
  std::uint32_t max_depth = 128;  ///< nested elements; a top-level element has depth 1
  /// Bytes: the receiver's limit for messages. Whoever cut the message out of the stream has kept to it; here it bounds
  /// what a message may become, so that few bytes do not ask for much memory or time.
  std::size_t message_limit = 12u * 1024 * 1024;

  /// Bytes of the texts that string codes stand for, counted each time one is named.
  std::size_t max_coded_text() const { return 4 * message_limit; }
  /// Elements of one message.
  std::size_t max_elements() const { return std::max<std::size_t>(65536, message_limit / 12); }
};

/// Decodes exactly one message. `bytes` must hold the whole message and outlive `message`, which borrows from it.
/// Clears `message` first. Allocates no more than the bytes in hand can justify.
/// Errors   the classes of the messages spec, section 14, and protocol_error beyond a limit of the options; the text
///          names field and byte offset.
[[nodiscard]] Result<> decode(ByteSpan bytes, const DecodeOptions& options, Message& message);

/// Sizes and string codes, found before the first byte is written. Items lie as in Message::entries and ::elements.
struct EncodePlan {
  static constexpr std::uint32_t inline_text = 0xffffffff;  ///< instead of a code: the text itself is written
  struct Item {
    std::uint32_t size = 0;                      ///< bytes on the wire, descendants included
    std::uint32_t name_code = inline_text;       ///< ElementName; MemberName of an entry
    std::uint32_t qualifier_code = inline_text;  ///< ElementTypeName; ServicePath of an entry
  };
  std::vector<Item> entries;
  std::vector<Item> elements;
};

/// Encoded bytes as slices to be written in order. Small fields lie in one owned buffer; payloads of at least
/// `gather_threshold` bytes are referenced in place and kept alive by the owners of the Message that they came from.
class EncodedMessage {
 public:
  static constexpr std::size_t gather_threshold = 4096;

  EncodedMessage() = default;
  EncodedMessage(EncodedMessage&&) = default;
  EncodedMessage& operator=(EncodedMessage&&) = default;

  std::size_t size() const { return size_; }
  /// Slices in write order; valid until the next encode() into this object or its destruction (moves keep them valid).
  const std::vector<ByteSpan>& slices() const { return slices_; }
  /// All bytes in one piece (a copy), for tests and small messages.
  Bytes to_bytes() const;
  /// Encodings from now on remember where they have the bytes of this element, which is not referenced; null: of none.
  void mark(const std::uint8_t* data) { marked_ = data; }
  /// Becomes a copy of a version-4 message that has a MessageID, with another one, and with other bytes of the marked
  /// element. Referenced payloads are shared.
  void assign(const EncodedMessage& other, std::uint16_t message_id, ByteSpan marked = {});
  /// The same in place, for the next receiver.
  void address(std::uint16_t message_id, ByteSpan marked);
  void clear();

 private:
  friend class GatherWriter;
  std::size_t size_ = 0;
  Bytes scratch_;
  std::vector<ByteSpan> slices_;
  std::vector<std::shared_ptr<const void>> owners_;
  std::size_t message_id_at_ = 0;  ///< in scratch_; version 4
  const std::uint8_t* marked_ = nullptr;
  std::size_t marked_at_ = 0;  ///< in scratch_
  EncodePlan plan_;            ///< kept for its capacity only
};

struct EncodeOptions {
  StringTableMode string_table = {};  ///< applied to version 4 only
  /// Bytes; a larger message gives buffer_limit_violation and nothing is written. A receiver's default limit less 100.
  std::size_t max_message_size = 12u * 1024 * 1024 - 100;
};

/// Encodes `message` in the version of its header. `out` is overwritten and its capacity reused.
/// Errors   buffer_limit_violation: the message is too large; protocol_error: another limit of section 11, version-4
///          features in a version-2 message, an unknown version;
///          data_type_error: a type that never travels; data_serialization_error: count and data of an element
///          disagree.
[[nodiscard]] Result<> encode(const Message& message, const EncodeOptions& options, EncodedMessage& out);

}  // namespace rr
