#include "node/transport/websocket.hpp"

#include <boost/asio/as_tuple.hpp>
#include <boost/asio/error.hpp>
#include <boost/asio/this_coro.hpp>
#include <boost/asio/use_awaitable.hpp>
#include <boost/system/errc.hpp>

namespace rr {

namespace asio = boost::asio;

namespace {

/// How long a close frame may take to leave, and how long its answer is waited for.
constexpr std::chrono::milliseconds stream_close_time{1000};

}  // namespace

WebSocketStream::WebSocketStream(std::unique_ptr<ByteStream> inner, WebSocketRole role, bool takes_close)
    : inner_(std::move(inner)),
      role_(role),
      decoder_(role),
      splitter_(role),
      close_limit_(inner_->executor(), [this] { inner_->close(); }),
      takes_close_(takes_close),
      written_(inner_->executor(), asio::steady_timer::time_point::max()) {}

awaitable<ReadResult> WebSocketStream::read_some(std::span<std::uint8_t> into) {
  if (const auto count = take_put_back(into)) co_return ReadResult{{}, count};
  for (;;) {
    if (decoder_.received_close()) co_return ReadResult{};
    const auto read = co_await inner_->read_some(into);
    if (read.error || read.is_end()) co_return read;
    const auto payload = decoder_.decode(into.first(read.bytes));
    if (!payload) {
      takes_close_ = true;  // whoever sends such frames is not a native peer, and this connection ends anyway
      violation_ = EndReason{decoder_.close_code(), payload.error().message};
      co_return ReadResult{boost::system::errc::make_error_code(boost::system::errc::protocol_error), 0};
    }
    if (auto ping = decoder_.take_ping()) {
      const auto pong = make_control_frame(role_, WebSocketOpcode::pong, *ping);
      const ByteSpan slice(pong);
      const std::span<const ByteSpan> slices(&slice, 1);
      if (const auto error = co_await write_raw(slices); error) co_return ReadResult{error, 0};
    }
    if (*payload > 0) co_return ReadResult{{}, *payload};
  }
}

awaitable<error_code> WebSocketStream::write(std::span<const ByteSpan> slices) {
  while (is_writing_) co_await written_.async_wait(asio::as_tuple(asio::use_awaitable));
  const auto frames = splitter_.split(slices);
  if (frames.empty()) co_return error_code();  // an empty frame would end a native peer's connection
  co_return co_await write_raw(frames);
}

awaitable<error_code> WebSocketStream::write_raw(std::span<const ByteSpan> slices) {
  while (is_writing_) co_await written_.async_wait(asio::as_tuple(asio::use_awaitable));
  if (is_broken_) co_return asio::error::broken_pipe;
  is_writing_ = true;
  const auto error = co_await inner_->write(slices);
  is_writing_ = false;
  is_broken_ = static_cast<bool>(error);
  written_.cancel();
  co_return error;
}

awaitable<void> WebSocketStream::end(const EndReason& given) {
  const auto& reason = violation_ ? *violation_ : given;
  const auto& received = decoder_.received_close();
  if (!is_broken_ && (takes_close_ || received || decoder_.has_seen_control())) {
    const auto frame =
        received ? make_close_frame(role_, received->code, {}) : make_close_frame(role_, reason.code, reason.text);
    const ByteSpan slice(frame);
    const std::span<const ByteSpan> slices(&slice, 1);
    close_limit_.arm(stream_close_time);
    co_await write_raw(slices);
    close_limit_.disarm();
  }
  co_await inner_->end(reason);
}

}  // namespace rr
