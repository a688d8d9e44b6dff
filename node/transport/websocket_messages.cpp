#include "node/transport/websocket_messages.hpp"

#include <boost/asio/as_tuple.hpp>
#include <boost/asio/error.hpp>
#include <boost/asio/use_awaitable.hpp>
#include <cstring>

#include "core/support/utf8.hpp"
#include "node/transport/count_guard.hpp"

namespace rr {

namespace asio = boost::asio;

namespace {

constexpr std::size_t read_bytes = 16 * 1024;
/// How long a close frame may take to leave.
constexpr std::chrono::milliseconds message_close_time{1000};

/// Of a final frame of text.
Bytes text_header(std::size_t payload) {
  Bytes out{0x80u | static_cast<std::uint8_t>(WebSocketOpcode::text)};
  const int width = payload < 126 ? 0 : payload <= 0xffff ? 2 : 8;
  out.push_back(static_cast<std::uint8_t>(width == 0 ? payload : width == 2 ? 126 : 127));
  for (int i = width - 1; i >= 0; --i) out.push_back(static_cast<std::uint8_t>(std::uint64_t{payload} >> (8 * i)));
  return out;
}

}  // namespace

// --- the decoder ---

Error WebSocketMessageDecoder::fail(std::uint16_t code, std::string what) {
  close_code_ = code;
  return protocol_error("WebSocket: " + std::move(what));
}

Result<std::size_t> WebSocketMessageDecoder::feed(ByteSpan bytes) {
  std::size_t at = 0;
  while (at < bytes.size() && !message_ && !ping_ && !close_) {
    if (!in_payload_) {
      header_.push_back(bytes[at++]);
      if (header_.size() < 2) continue;
      const std::uint8_t length = header_[1] & 0x7f;
      const std::size_t whole = 6u + (length == 126 ? 2u : length == 127 ? 8u : 0u);
      // A client's frames have a mask; one without is refused before its end is looked for.
      if ((header_[1] & 0x80) == 0) return fail(1002, "frame of a client without mask");
      if (header_.size() < whole) continue;
      if (auto begun = begin_frame(); !begun) return begun.error();
    } else {
      const auto count = static_cast<std::size_t>(std::min<std::uint64_t>(left_, bytes.size() - at));
      const bool is_control = (first_byte_ & 0x08) != 0;
      const auto place = [&](auto& into) {
        const auto before = into.size();
        into.resize(before + count);
        unmask(bytes.data() + at, reinterpret_cast<std::uint8_t*>(into.data()) + before, count, mask_, mask_index_);
      };
      if (is_control)
        place(control_);
      else
        place(text_);
      mask_index_ = (mask_index_ + count) % 4;
      at += count;
      left_ -= count;
    }
    if (!in_payload_ || left_ != 0) continue;
    in_payload_ = false;
    if (auto ended = end_frame(); !ended) return ended.error();
  }
  return at;
}

Result<> WebSocketMessageDecoder::begin_frame() {
  first_byte_ = header_[0];
  std::size_t at = 0;
  left_ = read_frame_length(header_, at);
  std::memcpy(mask_.data(), header_.data() + at, 4);
  mask_index_ = 0;
  header_.clear();
  control_.clear();
  in_payload_ = true;
  const bool is_final = (first_byte_ & 0x80) != 0;
  if ((first_byte_ & 0x70) != 0) return fail(1002, "reserved bits are set, but no extension was agreed on");
  switch (static_cast<WebSocketOpcode>(first_byte_ & 0x0f)) {
    case WebSocketOpcode::continuation:
      if (!in_message_) return fail(1002, "a frame goes on with a message that has not begun");
      break;
    case WebSocketOpcode::text:
      if (in_message_) return fail(1002, "a message begins within another");
      break;
    case WebSocketOpcode::binary:
      return fail(1003, "binary frame; expected text");
    case WebSocketOpcode::close:
    case WebSocketOpcode::ping:
    case WebSocketOpcode::pong:
      if (!is_final || left_ > 125) return fail(1002, "control frame that is fragmented or longer than 125 bytes");
      return {};
    default:
      return fail(1002, "opcode " + std::to_string(first_byte_ & 0x0f) + " is reserved");
  }
  if (left_ > max_message_ - text_.size())
    return fail(1009, "a message of more than " + std::to_string(max_message_) + " bytes");
  in_message_ = !is_final;
  return {};
}

Result<> WebSocketMessageDecoder::end_frame() {
  switch (static_cast<WebSocketOpcode>(first_byte_ & 0x0f)) {
    case WebSocketOpcode::pong:
      return {};
    case WebSocketOpcode::ping:
      ping_ = control_;
      return {};
    case WebSocketOpcode::close:
      close_ = read_close_frame(control_);
      return {};
    default:
      if (in_message_) return {};
      if (!is_utf8(text_)) return fail(1007, "text that is not UTF-8");
      message_ = std::move(text_);
      text_.clear();
      return {};
  }
}

std::optional<std::string> WebSocketMessageDecoder::take_message() {
  return std::exchange(message_, std::nullopt);
}

std::optional<Bytes> WebSocketMessageDecoder::take_ping() {
  return std::exchange(ping_, std::nullopt);
}

// --- the socket ---

WebSocketMessages::WebSocketMessages(ByteStream& stream, std::size_t max_message_bytes, HasRoom has_room)
    : stream_(stream),
      has_room_(std::move(has_room)),
      decoder_(max_message_bytes),
      buffer_(read_bytes),
      close_limit_(stream.executor(), [this] { stream_.close(); }),
      written_(stream.executor(), asio::steady_timer::time_point::max()) {}

awaitable<std::optional<std::string>> WebSocketMessages::read() {
  for (;;) {
    if (decoder_.received_close()) co_return std::nullopt;
    if (unread_.empty()) {
      if (has_room_) (void)has_room_(decoder_.held_bytes());  // the message of before is not held any more
      const auto read = co_await stream_.read_some(buffer_);
      if (read.error || read.is_end()) {
        is_broken_ = is_broken_ || read.error != asio::error::operation_aborted;
        co_return std::nullopt;
      }
      last_heard_ = std::chrono::steady_clock::now();
      unread_ = ByteSpan(buffer_).first(read.bytes);
    }
    const auto taken = decoder_.feed(unread_);
    if (!taken) {
      violation_ = EndReason{decoder_.close_code(), taken.error().message};
      co_return std::nullopt;
    }
    unread_ = unread_.subspan(*taken);
    if (const auto ping = decoder_.take_ping())
      if (co_await write_control(WebSocketOpcode::pong, *ping)) co_return std::nullopt;
    auto message = decoder_.take_message();
    const auto size = message ? message->size() : decoder_.held_bytes();
    if (has_room_ && !has_room_(size)) {
      violation_ = EndReason{1013, "no memory left for a message of " + std::to_string(size) + " bytes"};
      co_return std::nullopt;
    }
    if (message) co_return message;
  }
}

awaitable<error_code> WebSocketMessages::write(std::span<const std::string> messages) {
  std::vector<Bytes> headers;
  std::vector<ByteSpan> slices;
  headers.reserve(messages.size());
  for (const auto& message : messages) {
    headers.push_back(text_header(message.size()));
    slices.emplace_back(headers.back());
    slices.push_back(as_bytes(message));
  }
  while (!is_broken_ && (is_writing_ || controls_ > 0))
    co_await written_.async_wait(asio::as_tuple(asio::use_awaitable));
  co_return co_await write_raw(slices);
}

awaitable<error_code> WebSocketMessages::ping() {
  return write_control(WebSocketOpcode::ping, {});
}

awaitable<error_code> WebSocketMessages::write_control(WebSocketOpcode opcode, ByteSpan payload) {
  const auto frame = make_control_frame(WebSocketRole::server, opcode, payload);
  const ByteSpan slice(frame);
  const std::span<const ByteSpan> slices(&slice, 1);
  const CountGuard waiting(controls_);
  co_return co_await write_raw(slices);
}

awaitable<error_code> WebSocketMessages::write_raw(std::span<const ByteSpan> slices) {
  while (is_writing_) co_await written_.async_wait(asio::as_tuple(asio::use_awaitable));
  if (is_broken_) co_return asio::error::broken_pipe;
  is_writing_ = true;
  const auto error = co_await stream_.write(slices);
  is_writing_ = false;
  if (error) is_broken_ = true;
  written_.cancel();
  co_return error;
}

awaitable<void> WebSocketMessages::end(const EndReason& given) {
  const auto& reason = violation_ ? *violation_ : given;
  if (!is_broken_) {
    const auto frame = make_close_frame(WebSocketRole::server, decoder_.received_close(), reason.code, reason.text);
    const ByteSpan slice(frame);
    const std::span<const ByteSpan> slices(&slice, 1);
    close_limit_.arm(message_close_time);
    co_await write_raw(slices);
    close_limit_.disarm();
  }
  co_await stream_.end(reason);
}

}  // namespace rr
