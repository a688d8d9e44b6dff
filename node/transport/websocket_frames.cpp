#include "node/transport/websocket_frames.hpp"

#include <algorithm>
#include <cstring>

#include "core/support/random.hpp"
#include "core/support/utf8.hpp"
#include "node/tls/base64.hpp"
#include "node/tls/digest.hpp"

namespace rr {

namespace {

bool is_control(WebSocketOpcode opcode) {
  return static_cast<std::uint8_t>(opcode) >= 8;
}

/// Length of a whole header by its first two bytes.
std::size_t header_length(std::uint8_t second) {
  const std::uint8_t length = second & 0x7f;
  return 2u + (length == 126 ? 2u : length == 127 ? 8u : 0u) + ((second & 0x80) != 0 ? 4u : 0u);
}

/// Unpredictable, so that no page chooses the bytes that a proxy sees (RFC 6455, 10.3).
WebSocketMask make_mask() {
  WebSocketMask mask;
  const auto random = random_u32();
  std::memcpy(mask.data(), &random, sizeof(random));
  return mask;
}

/// Codes that may stand in a close frame (RFC 6455, 7.4).
bool is_sendable_code(std::uint16_t code) {
  return (code >= 1000 && code <= 1014 && code != 1004 && code != 1005 && code != 1006) ||
         (code >= 3000 && code <= 4999);
}

class WebSocketCategory final : public boost::system::error_category {
 public:
  const char* name() const noexcept override { return "rr.websocket"; }
  std::string message(int value) const override {
    switch (static_cast<WebSocketViolation>(value)) {
      case WebSocketViolation::reserved_bits:
        return "WebSocket: reserved bits are set, but no extension was agreed on";
      case WebSocketViolation::text_frame:
        return "WebSocket: text frame; expected binary frames";
      case WebSocketViolation::reserved_opcode:
        return "WebSocket: frame with a reserved opcode";
      case WebSocketViolation::no_mask:
        return "WebSocket: frame of a client without mask";
      case WebSocketViolation::frame_length:
        return "WebSocket: frame length with its highest bit set";
      case WebSocketViolation::control_frame:
        return "WebSocket: control frame that is fragmented or longer than 125 bytes";
    }
    return "WebSocket: unknown violation";
  }
};

}  // namespace

boost::system::error_code make_error_code(WebSocketViolation violation) {
  static const WebSocketCategory category;
  return {static_cast<int>(violation), category};
}

std::size_t WebSocketDecoder::decode(std::span<std::uint8_t> bytes, boost::system::error_code& error) {
  std::size_t out = 0;
  std::size_t in = 0;
  while (in < bytes.size() && !close_) {
    if (!in_payload_) {
      header_[header_size_++] = bytes[in++];
      if (header_size_ < 2 || header_size_ < header_length(header_[1])) continue;
      if (const auto violation = begin_frame()) {
        if (violation == WebSocketViolation::text_frame) close_code_ = 1003;
        error = *violation;
        return out;
      }
      if (left_ == 0 && is_control(opcode_)) end_control();
      continue;
    }
    const auto count = static_cast<std::size_t>(std::min<std::uint64_t>(left_, bytes.size() - in));
    if (is_control(opcode_)) {
      const auto before = control_.size();
      control_.resize(before + count);
      unmask(bytes.data() + in, control_.data() + before, count, mask_, mask_index_);
    } else {
      unmask(bytes.data() + in, bytes.data() + out, count, mask_, mask_index_);
      out += count;
    }
    mask_index_ = (mask_index_ + count) % 4;
    in += count;
    left_ -= count;
    if (left_ != 0) continue;
    in_payload_ = false;
    if (is_control(opcode_)) end_control();
  }
  return out;
}

std::optional<WebSocketViolation> WebSocketDecoder::begin_frame() {
  header_size_ = 0;
  const bool is_final = (header_[0] & 0x80) != 0;
  if ((header_[0] & 0x70) != 0) return WebSocketViolation::reserved_bits;
  opcode_ = static_cast<WebSocketOpcode>(header_[0] & 0x0f);
  switch (opcode_) {
    case WebSocketOpcode::continuation:
    case WebSocketOpcode::binary:
    case WebSocketOpcode::close:
    case WebSocketOpcode::ping:
    case WebSocketOpcode::pong:
      break;
    case WebSocketOpcode::text:
      return WebSocketViolation::text_frame;
    default:
      return WebSocketViolation::reserved_opcode;
  }
  const bool is_masked = (header_[1] & 0x80) != 0;
  if (!is_masked && role_ == WebSocketRole::server) return WebSocketViolation::no_mask;
  std::size_t at = 0;
  left_ = read_frame_length(header_, at);
  if (left_ > INT64_MAX) return WebSocketViolation::frame_length;
  if (is_control(opcode_)) {
    if (!is_final || left_ > 125) return WebSocketViolation::control_frame;
    control_.clear();
  }
  mask_ = {};
  if (is_masked) std::memcpy(mask_.data(), header_.data() + at, 4);
  mask_index_ = 0;
  in_payload_ = left_ != 0;
  return std::nullopt;
}

void WebSocketDecoder::end_control() {
  has_seen_control_ = true;
  if (opcode_ == WebSocketOpcode::ping) ping_ = control_;
  if (opcode_ != WebSocketOpcode::close) return;
  close_ = read_close_frame(control_);
}

std::optional<Bytes> WebSocketDecoder::take_ping() {
  auto out = std::move(ping_);
  ping_.reset();
  return out;
}

void unmask(const std::uint8_t* from, std::uint8_t* to, std::size_t count, const WebSocketMask& mask,
            std::size_t index) {
  std::uint8_t rotated[8];
  for (std::size_t i = 0; i < 8; ++i) rotated[i] = mask[(index + i) % 4];
  std::uint64_t word_mask;
  std::memcpy(&word_mask, rotated, 8);
  std::size_t i = 0;
  for (; i + 8 <= count; i += 8) {  // each word is read before its place is written: `to` <= `from` is safe
    std::uint64_t word;
    std::memcpy(&word, from + i, 8);
    word ^= word_mask;
    std::memcpy(to + i, &word, 8);
  }
  for (; i < count; ++i) to[i] = static_cast<std::uint8_t>(from[i] ^ rotated[i % 8]);
}

std::uint64_t read_frame_length(ByteSpan header, std::size_t& at) {
  at = 2;
  const std::uint8_t brief = header[1] & 0x7f;
  if (brief < 126) return brief;
  std::uint64_t length = 0;
  for (const std::size_t end = brief == 126 ? 4 : 10; at < end; ++at) length = length << 8 | header[at];
  return length;
}

FrameHeader make_frame_header(WebSocketOpcode opcode, std::size_t payload, const WebSocketMask* mask) {
  FrameHeader header{};
  const std::uint8_t mask_bit = mask ? 0x80 : 0;
  const auto add = [&](std::size_t byte) { header.bytes[header.size++] = static_cast<std::uint8_t>(byte); };
  add(0x80u | static_cast<std::uint8_t>(opcode));
  if (payload < 126) {
    add(mask_bit | payload);
  } else {
    add(mask_bit | 126u);
    add(payload >> 8);
    add(payload);
  }
  if (mask)
    for (const auto byte : *mask) add(byte);
  return header;
}

Bytes make_control_frame(WebSocketRole role, WebSocketOpcode opcode, ByteSpan payload) {
  const auto kept = payload.first(std::min<std::size_t>(payload.size(), 125));
  const auto mask = role == WebSocketRole::client ? make_mask() : WebSocketMask{};
  const auto header = make_frame_header(opcode, kept.size(), role == WebSocketRole::client ? &mask : nullptr);
  Bytes out(header.size + kept.size());
  std::copy_n(header.bytes.begin(), header.size, out.begin());
  unmask(kept.data(), out.data() + header.size, kept.size(), mask, 0);
  return out;
}

Bytes make_close_frame(WebSocketRole role, std::uint16_t code, std::string_view reason) {
  if (!is_sendable_code(code)) return make_control_frame(role, WebSocketOpcode::close, {});
  reason = utf8_prefix(reason, 123);
  Bytes payload{static_cast<std::uint8_t>(code >> 8), static_cast<std::uint8_t>(code)};
  payload.insert(payload.end(), reason.begin(), reason.end());
  return make_control_frame(role, WebSocketOpcode::close, payload);
}

Bytes make_close_frame(WebSocketRole role, const std::optional<CloseFrame>& received, std::uint16_t code,
                       std::string_view reason) {
  return received ? make_close_frame(role, received->code, {}) : make_close_frame(role, code, reason);
}

CloseFrame read_close_frame(ByteSpan payload) {
  if (payload.size() < 2) return {};
  return {static_cast<std::uint16_t>(payload[0] << 8 | payload[1]), std::string(as_text(payload.subspan(2)))};
}

FrameSplitter::Frame FrameSplitter::begin_frame(std::size_t payload) const {
  const bool is_masked = role_ == WebSocketRole::client;
  Frame frame{{}, 0, payload, is_masked ? make_mask() : WebSocketMask{}, 0};
  frame.header = make_frame_header(WebSocketOpcode::binary, payload, is_masked ? &frame.mask : nullptr);
  frame.header_left = frame.header.size;
  return frame;
}

std::span<const ByteSpan> FrameSplitter::split(std::span<const ByteSpan> payload, std::size_t limit) {
  const bool is_masked = role_ == WebSocketRole::client;
  std::size_t left = 0;
  for (const auto& slice : payload) left += slice.size();
  left = std::min(left, limit);
  const std::size_t most_frames = left / max_frame_payload + (open_ ? 2 : 1);
  frames_.clear();
  frames_.reserve(most_frames);  // slices_ points into it
  slices_.clear();
  masked_.clear();
  if (is_masked) masked_.reserve(left + most_frames * sizeof(FrameHeader));
  std::size_t room = 0;  // what is still free of the last frame
  for (auto slice : payload) {
    slice = slice.first(std::min(slice.size(), left));
    while (!slice.empty()) {
      if (room == 0) {
        frames_.push_back(frames_.empty() && open_ ? *open_ : begin_frame(std::min(left, max_frame_payload)));
        room = frames_.back().payload_left;
        const auto header = frames_.back().header.span().last(frames_.back().header_left);
        if (is_masked)
          masked_.insert(masked_.end(), header.begin(), header.end());
        else if (!header.empty())
          slices_.push_back(header);
      }
      const auto& frame = frames_.back();
      const auto part = slice.first(std::min(slice.size(), room));
      if (is_masked) {
        const auto at = masked_.size();
        masked_.resize(at + part.size());
        const auto index = frame.mask_index + (frame.payload_left - room);
        unmask(part.data(), masked_.data() + at, part.size(), frame.mask, index % 4);
      } else {
        slices_.push_back(part);
      }
      slice = slice.subspan(part.size());
      room -= part.size();
      left -= part.size();
    }
  }
  if (!masked_.empty()) slices_.push_back(masked_);
  return slices_;
}

std::size_t FrameSplitter::consume(std::size_t bytes) {
  std::size_t payload = 0;
  for (auto& frame : frames_) {
    if (bytes == 0) break;
    const auto of_header = std::min(bytes, frame.header_left);
    const auto of_payload = std::min(bytes - of_header, frame.payload_left);
    frame.header_left -= of_header;
    frame.payload_left -= of_payload;
    frame.mask_index = (frame.mask_index + of_payload) % 4;
    bytes -= of_header + of_payload;
    payload += of_payload;
    open_.reset();
    if (frame.payload_left > 0) open_ = frame;
  }
  return payload;
}

std::string websocket_accept(std::string_view key) {
  const std::string text = std::string(key) + "258EAFA5-E914-47DA-95CA-C5AB0DC85B11";
  return encode_base64(sha1(as_bytes(text)));
}

}  // namespace rr
