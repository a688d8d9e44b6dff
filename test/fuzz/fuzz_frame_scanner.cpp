// A stream fed in pieces gives the same messages, and the same verdict, as the stream fed at once.
//
// Input: the first byte is the number of piece sizes, then that many sizes, then the stream.
#include <algorithm>
#include <cstdint>
#include <cstdlib>
#include <vector>

#include "core/wire/frame_scanner.hpp"
#include "test/fuzz/memory_bound.hpp"

namespace {

using rr::Bytes;
using rr::ByteSpan;

constexpr std::size_t limit = 4096;

struct Outcome {
  std::vector<Bytes> messages;
  bool is_refused = false;
  bool operator==(const Outcome&) const = default;
};

Outcome scan(ByteSpan stream, ByteSpan piece_sizes) {
  Outcome outcome;
  rr::FrameScanner scanner(limit);
  for (std::size_t piece_index = 0; !stream.empty(); ++piece_index) {
    const std::size_t size = piece_sizes.empty() ? stream.size() : piece_sizes[piece_index % piece_sizes.size()] + 1u;
    // A copy of its own, so that reading outside the piece is seen.
    const Bytes piece(stream.begin(), stream.begin() + static_cast<std::ptrdiff_t>(std::min(size, stream.size())));
    stream = stream.subspan(piece.size());
    for (ByteSpan rest = piece; !rest.empty();) {
      const auto consumed = scanner.feed(rest);
      if (!consumed) {
        outcome.is_refused = true;
        return outcome;
      }
      if (*consumed == 0 || *consumed > rest.size()) std::abort();
      rest = rest.subspan(*consumed);
      if (const auto message = scanner.message()) {
        if (message->size() < 16 || message->size() > limit) std::abort();
        outcome.messages.emplace_back(message->begin(), message->end());
      } else if (!rest.empty()) {
        std::abort();  // stopped without a reason
      }
    }
  }
  return outcome;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const rr::fuzz::MemoryBound bound(size);
  if (size == 0) return 0;
  const std::size_t piece_count = std::min<std::size_t>(data[0] % 16, size - 1);
  const ByteSpan piece_sizes(data + 1, piece_count);
  const ByteSpan stream(data + 1 + piece_count, size - 1 - piece_count);
  if (scan(stream, piece_sizes) != scan(stream, {})) std::abort();
  return 0;
}
