#include "node/transport/websocket.hpp"

#include <boost/asio/error.hpp>
#include <boost/system/errc.hpp>

#include "node/transport/await_tuple.hpp"
#include "node/transport/count_guard.hpp"

namespace rr {

namespace asio = boost::asio;

namespace {

/// How long a close frame may take to leave, and how long its answer is waited for.
constexpr std::chrono::milliseconds stream_close_time{1000};

}  // namespace

WebSocketStream::WebSocketStream(std::unique_ptr<ByteStream> inner, WebSocketRole role, bool takes_close)
    : inner_(std::move(inner)),
      role_(role),
      takes_close_(takes_close),
      splitter_(role),
      decoder_(role),
      close_limit_(inner_->executor(), [this] { inner_->close(); }),
      written_(inner_->executor(), asio::steady_timer::time_point::max()) {}

awaitable<ReadResult> WebSocketStream::read_some(std::span<std::uint8_t> into) {
  if (const auto count = take_put_back(into)) co_return ReadResult{{}, count};
  for (const auto cancels = cancels_; cancels == cancels_;) {
    if (decoder_.received_close()) co_return ReadResult{};
    const auto read = co_await inner_->read_some(into);
    if (read.error || read.is_end()) co_return read;
    error_code violation;
    const auto payload = decoder_.decode(into.first(read.bytes), violation);
    if (violation) {
      takes_close_ = true;  // whoever sends such frames is not a native peer, and this connection ends anyway
      violation_ = EndReason{decoder_.close_code(), violation.message()};
      co_return ReadResult{violation, 0};
    }
    if (auto ping = decoder_.take_ping()) {
      auto pong = make_control_frame(role_, WebSocketOpcode::pong, *ping);
      if (const auto error = co_await write_control(std::move(pong)); error) co_return ReadResult{error, 0};
    }
    if (payload > 0) co_return ReadResult{{}, payload};
  }
  co_return ReadResult{asio::error::operation_aborted, 0};
}

void WebSocketStream::cancel() {
  ++cancels_;
  inner_->cancel();
}

std::size_t WebSocketStream::try_write(std::span<const ByteSpan> slices, error_code& error) {
  error = is_broken_ ? error_code(asio::error::broken_pipe) : error_code();
  if (error || !may_write()) return 0;
  // One frame at a time: a client masks what it tries to write, and does so again with what the stream did not take.
  const auto frames = splitter_.split(slices, max_frame_payload);
  if (frames.empty()) return 0;
  const auto payload = splitter_.consume(inner_->try_write(frames, error));
  is_broken_ = static_cast<bool>(error);
  if (controls_ > 0) written_.cancel();  // nobody else can wait: there is one writer
  return payload;
}

awaitable<error_code> WebSocketStream::write(std::span<const ByteSpan> slices) {
  while (!is_broken_ && !may_write()) co_await written_.async_wait(await_tuple);
  if (is_broken_) co_return asio::error::broken_pipe;
  const auto frames = splitter_.split(slices);
  if (frames.empty()) co_return error_code();  // an empty frame would end a native peer's connection
  std::size_t size = 0;
  for (const auto& frame : frames) size += frame.size();
  const auto error = co_await write_raw(frames);
  // Of a frame that try_write() has begun this may be a part only.
  if (!error) splitter_.consume(size);
  co_return error;
}

/// Data does not keep a control frame waiting, for as long as it takes a peer to read all that there is.
bool WebSocketStream::may_write() const {
  return !is_writing_ && (controls_ == 0 || splitter_.is_in_frame());
}

awaitable<error_code> WebSocketStream::write_control(Bytes frame) {
  const CountGuard waiting(controls_);
  while (!is_broken_ && (is_writing_ || splitter_.is_in_frame())) co_await written_.async_wait(await_tuple);
  if (is_broken_) co_return asio::error::broken_pipe;
  const ByteSpan slice(frame);
  const std::span<const ByteSpan> slices(&slice, 1);
  co_return co_await write_raw(slices);
}

awaitable<error_code> WebSocketStream::write_raw(std::span<const ByteSpan> slices) {
  is_writing_ = true;
  const auto error = co_await inner_->write(slices);
  is_writing_ = false;
  if (error) is_broken_ = true;
  written_.cancel();
  co_return error;
}

void WebSocketStream::close() {
  is_broken_ = true;
  inner_->close();
  written_.cancel();
}

std::string WebSocketStream::peer_reason() const {
  const auto& received = decoder_.received_close();
  if (!received) return {};
  const auto& [code, reason] = *received;
  if (!reason.empty()) return "code " + std::to_string(code) + ", " + quote(reason, 123);
  return code == 1000 || code == 1005 ? std::string() : "code " + std::to_string(code);
}

awaitable<void> WebSocketStream::end(const EndReason& given) {
  const auto& reason = violation_ ? *violation_ : given;
  const auto& received = decoder_.received_close();
  if (!is_broken_ && !splitter_.is_in_frame() && (takes_close_ || received || decoder_.has_seen_control())) {
    auto frame = make_close_frame(role_, received, reason.code, reason.text);
    close_limit_.arm(stream_close_time);
    co_await write_control(std::move(frame));
    close_limit_.disarm();
  }
  co_await inner_->end(reason);
}

}  // namespace rr
