// Encoded messages waiting for the stream: in order, bounded, with a lane for urgent ones. Layer: session.
#pragma once

#include <cstddef>
#include <memory>
#include <span>
#include <vector>

#include "core/wire/codec.hpp"
#include "core/wire/shared_message.hpp"

namespace rr {

/// Encoded messages that wait to be written. A driver takes slices(), writes any number of their bytes and reports them
/// with consume() before it takes slices() again. Messages whose slices were handed out stay where they are until then;
/// urgent messages go ahead of all others.
class TransmitQueue {
 public:
  /// As many bytes are written at once: what is urgent waits for no more than that.
  static constexpr std::size_t write_size = 256 * 1024;

  /// Encodes `message` behind everything (or, if urgent, ahead of what is not being written yet).
  Result<> push(const Message& message, const EncodeOptions& options, bool is_urgent = false);
  Result<> push(SharedMessage& message, const EncodeOptions& options, bool is_urgent = false);

  /// Bytes not yet consumed.
  std::size_t size() const { return size_; }
  /// Those, and what the messages themselves take: the larger part of many small ones.
  std::size_t held() const { return held_; }

  /// What to write next, in order: 32 slices at most, and none behind write_size bytes. They stay valid until
  /// consume().
  std::span<const ByteSpan> slices();

  /// `bytes` of the slices handed out were written, and no more of them is being written.
  void consume(std::size_t bytes);

 private:
  using Encoded = std::unique_ptr<EncodedMessage>;
  /// Of memory, beside its bytes: the object, and the allocations that an encoding makes (64-bit, glibc).
  static constexpr std::size_t message_bytes = 320;

  Encoded take_spare();
  void insert(Encoded encoded, bool is_urgent);
  std::span<Encoded> waiting() { return std::span(messages_).subspan(first_); }
  void pop_front();

  std::vector<Encoded> messages_;
  std::size_t first_ = 0;       ///< of messages_ that is not written yet
  std::vector<Encoded> spare_;  ///< buffers to reuse
  std::vector<ByteSpan> slices_;
  std::size_t size_ = 0;
  std::size_t held_ = 0;
  std::size_t front_consumed_ = 0;  ///< bytes of the first message that are written already
  std::size_t in_flight_ = 0;       ///< messages, from the first one, of which bytes are written or may be
  std::size_t urgent_end_ = 0;      ///< messages, from the first one, up to the last urgent one: they keep their order
};

}  // namespace rr
