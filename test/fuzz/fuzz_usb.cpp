// A USB device that answers whatever it likes: nothing crashes, buffers keep their bounds, every stream that was closed
// stays closed.
//
// Input: a byte that chooses, then descriptors, or the device's answers: each a byte of length and that many bytes.
#include <algorithm>
#include <cstdlib>
#include <set>

#include "core/hardware/usb_link.hpp"
#include "core/hardware/usb_probe.hpp"
#include "core/hardware/usb_sub_packet.hpp"
#include "test/fuzz/memory_bound.hpp"

namespace {

using namespace rr;

class Answers {
 public:
  explicit Answers(ByteSpan bytes) : rest_(bytes) {}

  bool is_at_end() const { return rest_.empty(); }
  std::uint8_t byte() {
    if (rest_.empty()) return 0;
    const auto value = rest_[0];
    rest_ = rest_.subspan(1);
    return value;
  }
  /// A copy of its own, so that reading outside is seen.
  Bytes bytes() {
    const auto count = std::min<std::size_t>(byte(), rest_.size());
    Bytes out(rest_.begin(), rest_.begin() + static_cast<std::ptrdiff_t>(count));
    rest_ = rest_.subspan(count);
    return out;
  }
  UsbStatus status() {
    const auto value = byte();
    return value < 240 ? UsbStatus::ok : static_cast<UsbStatus>(value % 9);
  }

 private:
  ByteSpan rest_;
};

void parse_everything(ByteSpan bytes) {
  const Bytes copy(bytes.begin(), bytes.end());
  static_cast<void>(parse_usb_bos(copy));
  static_cast<void>(parse_usb_block(copy));
  static_cast<void>(parse_usb_languages(copy));
  static_cast<void>(parse_usb_string(copy));
  static_cast<void>(parse_usb_sub_packet(copy));
}

void probe(Answers answers) {
  UsbProbe probe(answers.byte() % 2 == 0 ? std::optional<UsbFunction>() : UsbFunction{});
  for (int count = 0; probe.poll_control(); ++count) {
    if (count > 7) std::abort();
    const auto status = answers.status();
    probe.handle_control(status, answers.bytes());
  }
  if (!probe.result()) std::abort();
}

void link(Answers answers) {
  constexpr std::size_t packet_size = 32;
  constexpr std::size_t max_unread = 512;
  UsbLinkOptions options;
  options.max_unread_bytes = max_unread;
  options.max_unsent_bytes = 256;
  options.max_streams = 8;
  UsbLink link({{0x81, true, packet_size}, {0x02, true, packet_size}}, 0, options);
  TimePoint now{};
  std::set<UsbStreamKey> open;
  std::set<UsbStreamKey> closed;
  std::vector<UsbRead> reads;
  std::vector<UsbWrite> writes;
  open.insert(link.open_stream());
  while (!answers.is_at_end()) {
    const auto chosen = [&] { return open.empty() ? 0 : *std::next(open.begin(), answers.byte() % open.size()); };
    switch (answers.byte() % 8) {
      case 0:
        if (open.size() < 12) open.insert(link.open_stream());
        break;
      case 1: {
        const auto key = chosen();
        link.close_stream(key);
        open.erase(key);
        break;
      }
      case 2: {
        const auto key = chosen();
        const auto data = answers.bytes();
        const auto taken = link.write(key, data);
        if (taken > 0 && closed.count(key) > 0) std::abort();
        break;
      }
      case 3: {
        Bytes into(answers.byte());
        if (link.read(chosen(), into) > into.size()) std::abort();
        break;
      }
      case 4:
        if (!reads.empty()) {
          const auto data = answers.bytes();
          const auto read = reads.front();
          reads.erase(reads.begin());
          std::copy_n(data.begin(), std::min(data.size(), read.into.size()), read.into.begin());
          link.handle_read(read.slot, answers.status(), data.size(), now);
        }
        break;
      case 5:
        if (!writes.empty()) {
          const auto write = writes.front();
          writes.erase(writes.begin());
          link.handle_written(write.slot, answers.status(), write.bytes.size());
        }
        break;
      case 6:
        if (link.poll_control()) {
          const auto status = answers.status();
          link.handle_control(status, answers.bytes());
        }
        break;
      case 7:
        now += std::chrono::seconds(answers.byte());
        link.handle_timeout(now);
        break;
    }
    while (const auto write = link.poll_write()) writes.push_back(*write);
    while (const auto read = link.poll_read()) reads.push_back(*read);
    if (reads.size() > UsbLink::slots || writes.size() > UsbLink::slots) std::abort();
    while (const auto event = link.poll_event()) {
      if (closed.count(event->stream) > 0) std::abort();  // nothing comes after closed
      if (event->kind == UsbEventKind::closed) closed.insert(event->stream);
    }
    for (const auto key : open)
      if (link.unread_bytes(key) > max_unread + (UsbLink::slots + 1) * packet_size) std::abort();
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const rr::fuzz::MemoryBound bound(size);
  if (size == 0) return 0;
  const ByteSpan rest(data + 1, size - 1);
  switch (data[0] % 3) {
    case 0:
      parse_everything(rest);
      break;
    case 1:
      probe(Answers(rest));
      break;
    case 2:
      link(Answers(rest));
      break;
  }
  return 0;
}
