#include "core/wire/frame_scanner.hpp"

#include <algorithm>

#include "core/wire/frame_start.hpp"

namespace rr {

Result<std::size_t> FrameScanner::feed(ByteSpan input) {
  release();

  if (buffer_.empty()) {
    const auto start = input.first(std::min(input.size(), frame_start_size));
    if (auto checked = check_frame_start(start, limit_); !checked) return checked.error();
    if (start.size() == frame_start_size && frame_message_size(start) <= input.size()) {
      message_ = input.first(frame_message_size(start));
      return message_->size();
    }
  }

  std::size_t consumed = 0;
  if (buffer_.size() < frame_start_size) {
    consumed = std::min(frame_start_size - buffer_.size(), input.size());
    append(input.first(consumed));
    if (auto checked = check_frame_start(buffer_, limit_); !checked) return checked.error();
    if (buffer_.size() < frame_start_size) return consumed;
    expected_ = frame_message_size(buffer_);
  }
  const auto rest = input.subspan(consumed, std::min(expected_ - buffer_.size(), input.size() - consumed));
  append(rest);
  if (buffer_.size() == expected_) message_ = ByteSpan(buffer_);
  return consumed + rest.size();
}

void FrameScanner::release() {
  if (!message_) return;
  message_.reset();
  clear_kept(buffer_);
  expected_ = 0;
}

void FrameScanner::append(ByteSpan bytes) {
  const std::size_t size = buffer_.size() + bytes.size();
  // The announced size is a promise of the peer's: the buffer only ever doubles what has really arrived.
  if (size > buffer_.capacity())
    buffer_.reserve(expected_ == 0 ? size : std::min(expected_, std::max(size, 2 * buffer_.capacity())));
  buffer_.insert(buffer_.end(), bytes.begin(), bytes.end());
}

}  // namespace rr
