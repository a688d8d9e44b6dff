// Lets a stream of Robot Raconteur messages pass, header by header. Layer: server/relay.
// Source: messages spec section 2.
#pragma once

#include <cstddef>
#include <cstdint>

#include "core/support/bytes.hpp"
#include "core/support/error.hpp"

namespace rrgate {

/// Looks at the first ten bytes of every message and at nothing else; the rest passes without being buffered, so that
/// a large message costs the gateway no memory and no delay. (rr::FrameScanner hands out whole messages instead.)
class FrameGate {
 public:
  explicit FrameGate(std::size_t max_message_size) : limit_(max_message_size) {}

  /// `bytes` follow those that passed before. Returns how many of them may pass: all, but for the last 9 at most, when
  /// they begin a message whose header is incomplete. Offer those again with what follows them.
  /// Errors   protocol_error: magic, version, or a size below 16 or above the limit. No byte of such a message passes.
  [[nodiscard]] rr::Result<std::size_t> pass(rr::ByteSpan bytes);

  /// Messages that have begun to pass.
  std::uint64_t messages() const { return messages_; }

  /// After in-stream TLS began: everything passes, unread.
  void make_opaque() { is_opaque_ = true; }
  bool is_opaque() const { return is_opaque_; }
  /// Whether one of the first messages was a service's consent to TLS: what follows, both ways, is no message. Asked of
  /// the gate from the device.
  bool has_seen_start_tls() const { return has_seen_start_tls_; }
  /// Whether the last error was a message above the limit.
  bool is_too_large() const { return is_too_large_; }

 private:
  void look_for_start_tls();

  std::size_t limit_;
  std::size_t left_ = 0;  ///< bytes of the current message still to come
  std::size_t seen_ = 0;  ///< messages, as long as they are looked at
  std::uint64_t messages_ = 0;
  rr::Bytes early_;  ///< the current message, if it is one of the first and small
  bool is_early_ = false;
  bool has_seen_start_tls_ = false;
  bool is_opaque_ = false;
  bool is_too_large_ = false;
};

}  // namespace rrgate
