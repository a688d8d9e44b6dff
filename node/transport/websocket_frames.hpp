// WebSocket frames, sans-IO. A client's are masked, a server's are plain. Layer: node/transport.
// Source: RFC 6455 sections 5 and 7; transports spec section 4.5 (what Robot Raconteur peers send and take).
//
// Robot Raconteur treats a WebSocket as a byte stream: boundaries of frames and messages mean nothing. So the decoder
// turns a read buffer into its payload in place, and fragments, lone continuations and empty frames need no care.
#pragma once

#include <array>
#include <boost/container/small_vector.hpp>
#include <boost/system/error_code.hpp>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

#include "core/support/bytes.hpp"
#include "core/support/error.hpp"

namespace rr {

enum class WebSocketOpcode : std::uint8_t { continuation = 0, text = 1, binary = 2, close = 8, ping = 9, pong = 10 };

/// Which end this is.
enum class WebSocketRole : std::uint8_t { server, client };

inline constexpr std::string_view websocket_subprotocol = "robotraconteur.robotraconteur.com";

/// The largest payload of one frame that native peers take for sure.
inline constexpr std::size_t max_frame_payload = 65535;

/// What a peer sent against RFC 6455, or against the binary frames of Robot Raconteur.
enum class WebSocketViolation {
  reserved_bits = 1,
  text_frame,
  reserved_opcode,
  no_mask,
  frame_length,
  control_frame,
};
boost::system::error_code make_error_code(WebSocketViolation violation);

using WebSocketMask = std::array<std::uint8_t, 4>;

/// What a close frame said. `code` is 1005 when it said nothing.
struct CloseFrame {
  std::uint16_t code = 1005;
  std::string reason;
};

class WebSocketDecoder {
 public:
  explicit WebSocketDecoder(WebSocketRole role) : role_(role) {}

  /// Turns received bytes into payload, in place: afterwards the first n bytes of `bytes` are payload, unmasked.
  /// Stops at a close frame; what follows it is dropped.
  /// Returns  n; 0 when the bytes held no payload.
  /// Errors   a WebSocketViolation. close_code() then has the code to close with.
  [[nodiscard]] std::size_t decode(std::span<std::uint8_t> bytes, boost::system::error_code& error);

  /// Payload of the newest ping that was not yet taken; it is to be answered by a pong with the same bytes.
  std::optional<Bytes> take_ping();
  const std::optional<CloseFrame>& received_close() const { return close_; }
  /// Whether the peer has sent any control frame, and so can be sent some.
  bool has_seen_control() const { return has_seen_control_; }
  std::uint16_t close_code() const { return close_code_; }

 private:
  std::optional<WebSocketViolation> begin_frame();
  void end_control();

  WebSocketRole role_;
  std::array<std::uint8_t, 14> header_{};
  std::size_t header_size_ = 0;  ///< bytes of the header in hand
  bool in_payload_ = false;
  WebSocketOpcode opcode_ = WebSocketOpcode::binary;
  std::uint64_t left_ = 0;  ///< payload bytes of this frame still to come
  WebSocketMask mask_{};
  std::size_t mask_index_ = 0;
  Bytes control_;
  std::optional<Bytes> ping_;
  std::optional<CloseFrame> close_;
  bool has_seen_control_ = false;
  std::uint16_t close_code_ = 1002;
};

/// Masks as well: to[i] = from[i] ^ mask[(index + i) % 4]. The ranges may overlap if `to` is not behind `from`.
void unmask(const std::uint8_t* from, std::uint8_t* to, std::size_t count, const WebSocketMask& mask,
            std::size_t index);

/// The length of a frame's payload, from a header that is there as far as the length goes; `at` is where it ends.
std::uint64_t read_frame_length(ByteSpan header, std::size_t& at);

/// The header of a final frame: 2 or 4 bytes, since `payload` is at most max_frame_payload, and the mask of a client's.
struct FrameHeader {
  std::array<std::uint8_t, 8> bytes;
  std::uint8_t size;
  ByteSpan span() const { return {bytes.data(), size}; }
};
FrameHeader make_frame_header(WebSocketOpcode opcode, std::size_t payload, const WebSocketMask* mask);

/// A whole control frame; `payload` is cut after 125 bytes.
Bytes make_control_frame(WebSocketRole role, WebSocketOpcode opcode, ByteSpan payload);
/// A close frame; `reason` is cut after 123 bytes, at a UTF-8 boundary. Code 1005 makes an empty one.
Bytes make_close_frame(WebSocketRole role, std::uint16_t code, std::string_view reason);
/// The last frame of a connection: the answer to a close frame of the peer, where one has come, else a frame of one's
/// own.
Bytes make_close_frame(WebSocketRole role, const std::optional<CloseFrame>& received, std::uint16_t code,
                       std::string_view reason);
CloseFrame read_close_frame(ByteSpan payload);

/// Lays slices out as binary frames of at most max_frame_payload bytes. A server's payload stays where it is; a
/// client's frames are made in a buffer, one behind the other. A frame that was written in part goes on with whatever
/// payload comes next: what its header has announced is only how many bytes follow.
class FrameSplitter {
 public:
  explicit FrameSplitter(WebSocketRole role) : role_(role) {}

  /// Headers and payload in write order, of the first `limit` bytes of payload; valid until the next call and as long
  /// as the input is.
  std::span<const ByteSpan> split(std::span<const ByteSpan> payload, std::size_t limit = SIZE_MAX);
  /// `bytes` of what split() returned were written. Returns how many of them are payload.
  std::size_t consume(std::size_t bytes);
  /// A frame is written in part: nothing but its rest may be written.
  bool is_in_frame() const { return open_.has_value(); }

 private:
  struct Frame {
    FrameHeader header;
    std::size_t header_left;   ///< bytes to be written
    std::size_t payload_left;  ///< bytes to be written
    WebSocketMask mask;
    std::size_t mask_index;  ///< of the first byte of payload_left
  };
  Frame begin_frame(std::size_t payload) const;

  WebSocketRole role_;
  std::optional<Frame> open_;
  boost::container::small_vector<Frame, 1> frames_;
  boost::container::small_vector<ByteSpan, 2> slices_;
  Bytes masked_;  ///< frames of a client
};

/// Sec-WebSocket-Accept of a Sec-WebSocket-Key.
std::string websocket_accept(std::string_view key);

}  // namespace rr

template <>
struct boost::system::is_error_code_enum<rr::WebSocketViolation> : std::true_type {};
