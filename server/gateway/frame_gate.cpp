#include "server/gateway/frame_gate.hpp"

#include <algorithm>

#include "core/wire/frame_start.hpp"

namespace rrgate {

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
    }
    const auto count = std::min(left_, bytes.size() - passed);
    left_ -= count;
    passed += count;
  }
  return passed;
}

}  // namespace rrgate
