#include "server/relay/frame_gate.hpp"

#include <algorithm>

#include "core/wire/codec.hpp"
#include "core/wire/frame_start.hpp"

namespace rrgate {

namespace {

/// STARTTLS stands at the beginning, behind a few other stream operations at most, and its answer is short.
constexpr std::size_t early_messages = 8;
constexpr std::size_t early_size = 4096;

}  // namespace

void FrameGate::look_for_start_tls() {
  ++seen_;
  rr::Message message;
  if (!early_.empty() && rr::decode(early_, {}, message) && message.entries.size() == 1) {
    const auto& entry = message.entries.front();
    has_seen_start_tls_ = entry.type == rr::EntryType::stream_op_ret && entry.member_name == "STARTTLS" &&
                          entry.error == rr::ErrorCode::none;
  }
  early_ = rr::Bytes();
}

rr::Result<std::size_t> FrameGate::pass(rr::ByteSpan bytes) {
  if (is_opaque_) return bytes.size();
  std::size_t passed = 0;
  while (passed < bytes.size()) {
    if (left_ == 0) {
      const auto start = bytes.subspan(passed).first(std::min(bytes.size() - passed, rr::frame_start_size));
      if (auto checked = rr::check_frame_start(start, limit_); !checked) {
        is_too_large_ = start.size() >= 8 && rr::as_text(start.first(4)) == rr::frame_magic &&
                        rr::frame_message_size(start) > limit_;
        return checked.error();
      }
      if (start.size() < rr::frame_start_size) return passed;
      left_ = rr::frame_message_size(start);
      ++messages_;
      is_early_ = seen_ < early_messages && left_ <= early_size;
    }
    const auto count = std::min(left_, bytes.size() - passed);
    if (is_early_) {
      const auto part = bytes.subspan(passed, count);
      early_.insert(early_.end(), part.begin(), part.end());
    }
    left_ -= count;
    passed += count;
    if (left_ == 0 && seen_ < early_messages) look_for_start_tls();
  }
  return passed;
}

}  // namespace rrgate
