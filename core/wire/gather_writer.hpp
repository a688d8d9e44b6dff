// Writes an encoded message as slices: small fields into one buffer, large payloads by reference. Layer: wire.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <string_view>

#include "core/support/bytes.hpp"
#include "core/support/node_id.hpp"
#include "core/wire/codec.hpp"
#include "core/wire/message.hpp"
#include "core/wire/variable_int.hpp"

namespace rr {

/// The write cursor of both codecs. Sizes are computed first, so the buffer is made once at its exact size and slices
/// into it stay valid. Writing past that size is caught and makes finish() fail; nothing is written out of bounds.
class GatherWriter {
 public:
  /// Starts over in `out`, whose memory is reused.
  explicit GatherWriter(EncodedMessage& out) : out_(out) { out_.clear(); }

  EncodePlan& plan() { return out_.plan_; }

  static bool is_gathered(ByteSpan payload) { return payload.size() >= EncodedMessage::gather_threshold; }

  /// `message_size` bytes will be written, of which `gathered_size` are referenced.
  void begin(std::size_t message_size, std::size_t gathered_size);

  template <class T>
  void number(T value) {
    if (std::uint8_t* to = take(sizeof(T))) std::memcpy(to, &value, sizeof(T));
  }

  void uint_x(std::uint32_t value) {
    if (value < uint_x_u16) return number(static_cast<std::uint8_t>(value));
    if (value <= 0xffff) {
      number(uint_x_u16);
      number(static_cast<std::uint16_t>(value));
    } else {
      number(uint_x_u32);
      number(value);
    }
  }

  void int_x(std::int32_t value) {
    switch (int_x_size(value)) {
      case 1:
        return number(static_cast<std::int8_t>(value));
      case 3:
        number(int_x_i16);
        return number(static_cast<std::int16_t>(value));
      default:
        number(int_x_i32);
        return number(value);
    }
  }

  void bytes(ByteSpan view) {
    if (std::uint8_t* to = take(view.size()); to != nullptr && !view.empty()) std::memcpy(to, view.data(), view.size());
  }
  void text16(std::string_view text) {
    number(static_cast<std::uint16_t>(text.size()));
    bytes(as_bytes(text));
  }
  void text_x(std::string_view text) {
    uint_x(static_cast<std::uint32_t>(text.size()));
    bytes(as_bytes(text));
  }
  void bytes_x(ByteSpan view) {
    uint_x(static_cast<std::uint32_t>(view.size()));
    bytes(view);
  }
  void message_id(std::uint16_t id) {
    out_.message_id_at_ = at_;
    number(id);
  }
  void node_id(const NodeId& id) { bytes(id.bytes); }

  /// Data of an element: copied when small, referenced when large.
  void payload(ByteSpan view);

  /// Ends the message and takes over the owners of what was referenced.
  /// Errors   internal_error: the bytes written are not those that were announced to begin().
  Result<> finish(const Message& message);

 private:
  std::uint8_t* take(std::size_t size) {
    if (size > out_.scratch_.size() - at_) [[unlikely]] {
      overflowed_ = true;
      return nullptr;
    }
    std::uint8_t* to = out_.scratch_.data() + at_;
    at_ += size;
    return to;
  }
  void close_slice();

  EncodedMessage& out_;
  std::size_t message_size_ = 0;
  std::size_t at_ = 0;           ///< in scratch_
  std::size_t slice_start_ = 0;  ///< in scratch_
  bool overflowed_ = false;
};

}  // namespace rr
