// A WebSocket as messages of text: what pages and programs expect of one, unlike Robot Raconteur peers (websocket.hpp).
// The server's end. Layer: node/transport. Source: RFC 6455 sections 5 to 7.
#pragma once

#include <boost/asio/steady_timer.hpp>
#include <chrono>
#include <functional>
#include <optional>
#include <span>
#include <string>

#include "node/transport/byte_stream.hpp"
#include "node/transport/watchdog.hpp"
#include "node/transport/websocket_frames.hpp"

namespace rr {

/// Frames of a client -> whole messages of text, sans-IO.
class WebSocketMessageDecoder {
 public:
  explicit WebSocketMessageDecoder(std::size_t max_message_bytes) : max_message_(max_message_bytes) {}

  /// Takes bytes until a message or a control frame is whole.
  /// Returns  bytes taken.
  /// Errors   protocol_error: what RFC 6455 forbids, binary frames, text that is not UTF-8, a message that is too long.
  ///          close_code() then has the code to close with.
  [[nodiscard]] Result<std::size_t> feed(ByteSpan bytes);

  std::optional<std::string> take_message();
  /// Bytes of the message that is not whole yet.
  std::size_t held_bytes() const { return text_.size(); }
  std::optional<Bytes> take_ping();
  const std::optional<CloseFrame>& received_close() const { return close_; }
  std::uint16_t close_code() const { return close_code_; }

 private:
  Result<> begin_frame();
  Result<> end_frame();
  Error fail(std::uint16_t code, std::string what);

  std::size_t max_message_;
  Bytes header_;
  bool in_payload_ = false;
  std::uint8_t first_byte_ = 0;  ///< of the frame: FIN and opcode
  std::uint64_t left_ = 0;       ///< payload bytes of this frame still to come
  WebSocketMask mask_{};
  std::size_t mask_index_ = 0;
  Bytes control_;
  bool in_message_ = false;  ///< between the first and the last frame of a message
  std::string text_;
  std::optional<std::string> message_;
  std::optional<Bytes> ping_;
  std::optional<CloseFrame> close_;
  std::uint16_t close_code_ = 1002;
};

class WebSocketMessages {
 public:
  /// Asked with the size of a message as far as it has come. False: the connection is closed with 1013.
  using HasRoom = std::function<bool(std::size_t bytes)>;
  /// `stream` has just carried the 101 response, and is borrowed. `has_room`  null: there always is.
  WebSocketMessages(ByteStream& stream, std::size_t max_message_bytes, HasRoom has_room = nullptr);

  /// The next message. Answers pings meanwhile. nullopt: the peer has ended it, or has gone, or cancel() was called.
  awaitable<std::optional<std::string>> read();
  /// Each a message, in order. For one writer at a time; pongs go out in between.
  awaitable<error_code> write(std::span<const std::string> messages);
  awaitable<error_code> ping();
  void cancel() { stream_.cancel(); }
  /// Closes in good order. What the peer itself did against the protocol goes before `reason`.
  awaitable<void> end(const EndReason& reason);

  /// When the peer was last heard of.
  std::chrono::steady_clock::time_point last_heard() const { return last_heard_; }

 private:
  awaitable<error_code> write_raw(std::span<const ByteSpan> slices);
  awaitable<error_code> write_control(WebSocketOpcode opcode, ByteSpan payload);

  ByteStream& stream_;
  HasRoom has_room_;
  WebSocketMessageDecoder decoder_;
  Bytes buffer_;
  ByteSpan unread_;  ///< of buffer_
  std::chrono::steady_clock::time_point last_heard_ = std::chrono::steady_clock::now();
  Deadline close_limit_;
  std::optional<EndReason> violation_;
  bool is_writing_ = false;
  std::size_t controls_ = 0;           ///< control frames that wait, or are written: they come before the next messages
  bool is_broken_ = false;             ///< a write ended in the middle of a frame: nothing more can be sent
  boost::asio::steady_timer written_;  ///< cancelled when a write ends
};

}  // namespace rr
