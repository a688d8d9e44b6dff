// A WebSocket that a program has accepted with Boost.Beast, as a byte stream. Layer: node/transport.
// Source: transports spec section 4.5.
#pragma once

#include <boost/asio/as_tuple.hpp>
#include <boost/asio/buffer.hpp>
#include <boost/asio/error.hpp>
#include <boost/asio/use_awaitable.hpp>
#include <boost/beast/core/stream_traits.hpp>
#include <boost/beast/core/tcp_stream.hpp>
#include <boost/beast/websocket/error.hpp>
#include <boost/beast/websocket/stream.hpp>
#include <chrono>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "core/support/utf8.hpp"
#include "node/transport/byte_stream.hpp"
#include "node/transport/watchdog.hpp"

namespace rr {

/// `WebSocket` is a boost::beast::websocket::stream over boost::beast::tcp_stream, with TLS between them or not. Its
/// timeouts (stream_base::timeout) stay as the program has set them, but native Robot Raconteur clients end a
/// connection at a ping.
template <class WebSocket>
class BeastStream final : public ByteStream {
 public:
  BeastStream(WebSocket websocket, std::string peer, std::chrono::milliseconds send_stall)
      : websocket_(std::move(websocket)),
        peer_(std::move(peer)),
        send_stall_(send_stall),
        stall_(executor(),
               [this] {
                 is_stalled_ = true;
                 close();
               }),
        close_limit_(executor(), [this] { close(); }) {
    websocket_.binary(true);
    websocket_.read_message_max(0);  // frames and messages mean nothing here
    boost::beast::get_lowest_layer(websocket_).expires_never();
  }

  awaitable<ReadResult> read_some(std::span<std::uint8_t> into) override {
    if (const auto count = take_put_back(into)) co_return ReadResult{{}, count};
    for (;;) {
      auto [error, bytes] =
          co_await websocket_.async_read_some(boost::asio::buffer(into.data(), into.size()), await_tuple);
      if (error == boost::beast::websocket::error::closed) co_return ReadResult{};
      if (error && is_stalled_) error = boost::asio::error::timed_out;
      if (error || bytes > 0) co_return ReadResult{error, bytes};
    }
  }
  awaitable<error_code> write(std::span<const ByteSpan> slices) override {
    // In pieces: who takes one in time is slow, and not stalled.
    std::vector<boost::asio::const_buffer> piece;
    std::size_t size = 0;
    for (auto slice : slices)
      while (!slice.empty()) {
        const auto part = slice.first(std::min(slice.size(), largest_piece - size));
        piece.emplace_back(part.data(), part.size());
        size += part.size();
        slice = slice.subspan(part.size());
        if (size < largest_piece) continue;
        if (const auto failed = co_await write_piece(piece)) co_return failed;
        piece.clear();
        size = 0;
      }
    // An empty frame would end a native peer's connection.
    if (piece.empty()) co_return error_code();
    co_return co_await write_piece(piece);
  }
  /// WebSockets have no half-closed state: does nothing, end() follows.
  void finish_sending() override {}
  void cancel() override { boost::beast::get_lowest_layer(websocket_).cancel(); }
  awaitable<void> end(const EndReason& reason) override {
    close_limit_.arm(std::chrono::seconds(1));
    const boost::beast::websocket::close_reason why(static_cast<boost::beast::websocket::close_code>(reason.code),
                                                    std::string(utf8_prefix(reason.text, 123)));
    co_await websocket_.async_close(why, await_tuple);
    close_limit_.disarm();
    close();
  }
  void close() override { boost::beast::get_lowest_layer(websocket_).close(); }
  std::string peer() const override { return peer_; }
  boost::asio::any_io_executor executor() override { return websocket_.get_executor(); }

 private:
  static constexpr std::size_t largest_piece = 16 * 1024;

  awaitable<error_code> write_piece(const std::vector<boost::asio::const_buffer>& piece) {
    stall_.arm(send_stall_);
    const auto [error, bytes] = co_await websocket_.async_write(piece, await_tuple);
    stall_.disarm();
    co_return is_stalled_ ? error_code(boost::asio::error::timed_out) : error;
  }

  static constexpr auto await_tuple = boost::asio::as_tuple(boost::asio::use_awaitable);

  WebSocket websocket_;
  std::string peer_;
  std::chrono::milliseconds send_stall_;
  Deadline stall_;
  Deadline close_limit_;
  bool is_stalled_ = false;
};

/// Takes over a WebSocket that is open, for Node::accept(). The program must have checked the Origin of its request:
/// the node does not see it, and browsers open WebSockets for pages of every site. `send_stall`: see
/// ByteStream::write().
template <class NextLayer>
std::unique_ptr<ByteStream> make_beast_stream(boost::beast::websocket::stream<NextLayer> websocket,
                                              std::chrono::milliseconds send_stall = std::chrono::seconds(15)) {
  error_code error;
  const auto remote = boost::beast::get_lowest_layer(websocket).socket().remote_endpoint(error);
  std::string peer =
      error ? std::string("unknown") : remote.address().to_string() + ":" + std::to_string(remote.port());
  return std::make_unique<BeastStream<boost::beast::websocket::stream<NextLayer>>>(std::move(websocket),
                                                                                   std::move(peer), send_stall);
}

}  // namespace rr
