#include "core/session/transmit_queue.hpp"

#include <algorithm>

namespace rr {

namespace {
constexpr std::size_t max_spare_messages = 16;
constexpr std::size_t max_slices = 32;
}  // namespace

TransmitQueue::Encoded TransmitQueue::take_spare() {
  if (spare_.empty()) return std::make_unique<EncodedMessage>();
  auto spare = std::move(spare_.back());
  spare_.pop_back();
  return spare;
}

Result<> TransmitQueue::push(const Message& message, const EncodeOptions& options, bool is_urgent) {
  auto encoded = take_spare();
  if (auto done = encode(message, options, *encoded); !done) return done;
  insert(std::move(encoded), is_urgent);
  return {};
}

Result<> TransmitQueue::push(SharedMessage& message, const EncodeOptions& options, bool is_urgent) {
  auto encoded = take_spare();
  if (auto done = message.encode(options, *encoded); !done) return done;
  insert(std::move(encoded), is_urgent);
  return {};
}

void TransmitQueue::insert(Encoded encoded, bool is_urgent) {
  size_ += encoded->size();
  held_ += encoded->size() + message_bytes;
  if (!is_urgent) {
    messages_.push_back(std::move(encoded));
    return;
  }
  const auto place = std::max(in_flight_, urgent_end_);
  messages_.insert(messages_.begin() + static_cast<std::ptrdiff_t>(first_ + place), std::move(encoded));
  urgent_end_ = place + 1;
}

std::span<const ByteSpan> TransmitQueue::slices() {
  slices_.clear();
  in_flight_ = 0;
  std::size_t skip = front_consumed_;
  std::size_t bytes = 0;
  const auto is_full = [&] { return slices_.size() >= max_slices || bytes >= write_size; };
  for (const auto& message : waiting()) {
    if (is_full()) break;
    ++in_flight_;
    for (const auto& slice : message->slices()) {
      if (skip >= slice.size()) {
        skip -= slice.size();
        continue;
      }
      if (is_full()) break;
      slices_.push_back(slice.subspan(skip));
      bytes += slices_.back().size();
      skip = 0;
    }
  }
  return slices_;
}

void TransmitQueue::consume(std::size_t bytes) {
  size_ -= bytes;
  front_consumed_ += bytes;
  while (first_ < messages_.size() && front_consumed_ >= messages_[first_]->size()) {
    front_consumed_ -= messages_[first_]->size();
    pop_front();
  }
  // Nothing may be put before the rest of a message that is written in part; nobody has begun to write the others.
  in_flight_ = front_consumed_ > 0 ? 1 : 0;
}

void TransmitQueue::pop_front() {
  auto& front = messages_[first_];
  held_ -= front->size() + message_bytes;
  front->clear();
  if (spare_.size() < max_spare_messages) spare_.push_back(std::move(front));
  front.reset();
  if (urgent_end_ > 0) --urgent_end_;
  // Written ones are taken out when they are half of all: nothing is moved twice as often as it is sent.
  if (++first_ * 2 < messages_.size()) return;
  messages_.erase(messages_.begin(), messages_.begin() + static_cast<std::ptrdiff_t>(first_));
  first_ = 0;
  if (messages_.empty()) clear_kept(messages_);
}

}  // namespace rr
