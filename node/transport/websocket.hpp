// A WebSocket as a byte stream. Layer: node/transport. Source: transports spec section 4.5.
#pragma once

#include <boost/asio/steady_timer.hpp>
#include <memory>

#include "node/transport/byte_stream.hpp"
#include "node/transport/watchdog.hpp"
#include "node/transport/websocket_frames.hpp"

namespace rr {

/// Native Robot Raconteur peers drop a connection at any ping, pong, close or empty frame. So none is sent, except a
/// pong or close that answers the peer's own, and a close with a reason to a peer that is known to take it.
class WebSocketStream final : public ByteStream {
 public:
  /// `inner` has just carried the 101 response. `role` is ours. `takes_close`: the peer is a browser or another full
  /// WebSocket client.
  WebSocketStream(std::unique_ptr<ByteStream> inner, WebSocketRole role, bool takes_close);

  awaitable<ReadResult> read_some(std::span<std::uint8_t> into) override;
  std::size_t try_write(std::span<const ByteSpan> slices, error_code& error) override;
  awaitable<error_code> write(std::span<const ByteSpan> slices) override;
  /// WebSockets have no half-closed state: does nothing, end() follows.
  void finish_sending() override {}
  void cancel() override;
  awaitable<void> end(const EndReason& reason) override;
  void close() override;
  std::string peer() const override { return inner_->peer(); }
  /// Of its close frame: "code 1008, 'not allowed'". A plain end has none.
  std::string peer_reason() const override;
  boost::asio::any_io_executor executor() override { return inner_->executor(); }

 private:
  /// Waits until no other frame is in the middle of being written.
  bool may_write() const;
  awaitable<error_code> write_control(Bytes frame);
  awaitable<error_code> write_raw(std::span<const ByteSpan> slices);

  // First what each write looks at, together.
  std::unique_ptr<ByteStream> inner_;
  WebSocketRole role_;
  bool takes_close_;
  bool is_writing_ = false;
  bool is_broken_ = false;    ///< closed, or a write ended within a frame: nothing more can be sent
  std::size_t controls_ = 0;  ///< control frames that wait, or are written: they come before the next frame of data
  FrameSplitter splitter_;
  WebSocketDecoder decoder_;
  Deadline close_limit_;
  std::size_t cancels_ = 0;             ///< a read of several steps looks at it between them
  std::optional<EndReason> violation_;  ///< what the peer did against RFC 6455
  boost::asio::steady_timer written_;   ///< cancelled when a write ends, and when the stream is closed
};

}  // namespace rr
