// Splits a byte stream into whole messages without decoding them. Layer: wire. Source: messages spec section 2.
#pragma once

#include <cstddef>
#include <optional>

#include "core/support/bytes.hpp"
#include "core/support/error.hpp"

namespace rr {

/// Splits a byte stream into whole Robot Raconteur messages without decoding them.
class FrameScanner {
 public:
  explicit FrameScanner(std::size_t max_message_size = 12u * 1024 * 1024) : limit_(max_message_size) {}

  /// `input`  borrowed for this call and, when message() then returns a value, until the next feed(); any length, may
  ///          begin or end mid-message.
  /// Returns  bytes consumed (0..input.size()); stops behind the first complete message, which message() then holds.
  /// Errors   protocol_error: bad magic, version not 2 or 4, size below 16 or above the limit (nothing allocated). The
  ///          stream is lost then: drop the scanner with its connection.
  [[nodiscard]] Result<std::size_t> feed(ByteSpan input);

  /// The complete message found by the last feed(): a view of its input where it lay there in one piece, else of the
  /// scanner's buffer. Empty when more bytes are needed.
  std::optional<ByteSpan> message() const { return message_; }
  /// The message is not needed any more, if there is one. The next feed() does this by itself; before it, the memory of
  /// a large message is given back.
  void release();

  /// Takes effect for the next message.
  void set_max_message_size(std::size_t limit) { limit_ = limit; }
  /// Bytes of the message that is not complete yet.
  std::size_t held_bytes() const { return buffer_.size(); }

 private:
  void append(ByteSpan bytes);

  std::size_t limit_;
  std::size_t expected_ = 0;  ///< size of the message being buffered; 0 while its first 10 bytes are incomplete
  Bytes buffer_;
  std::optional<ByteSpan> message_;
};

}  // namespace rr
