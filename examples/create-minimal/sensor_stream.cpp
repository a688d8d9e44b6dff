#include "sensor_stream.hpp"

#include <algorithm>
#include <numeric>

namespace create_minimal {

void StreamReader::feed(std::span<const std::uint8_t> bytes) {
  bytes_.insert(bytes_.end(), bytes.begin(), bytes.end());
}

std::optional<std::vector<std::uint8_t>> StreamReader::next() {
  for (;;) {
    bytes_.erase(bytes_.begin(), std::find(bytes_.begin(), bytes_.end(), stream_header));
    if (bytes_.size() < 2) return {};
    const bool is_header = bytes_[1] == packet_bytes;
    if (is_header && bytes_.size() < packet_bytes + 3u) return {};
    const auto end = bytes_.begin() + (is_header ? packet_bytes + 2 : 0);  // of the packet's bytes; then the check sum
    if (!is_header || std::accumulate(bytes_.begin(), end + 1, 0u) % 256 != 0) {
      bytes_.erase(bytes_.begin());  // 19 that was something else, or bytes are missing
      continue;
    }
    std::vector<std::uint8_t> packet(bytes_.begin() + 2, end);
    bytes_.erase(bytes_.begin(), end + 1);
    return packet;
  }
}

std::optional<Sensors> read_sensors(std::span<const std::uint8_t> packet) {
  Sensors out;
  while (!packet.empty()) {
    const auto id = packet.front();
    const std::size_t size = id == distance_id || id == angle_id ? 3 : 2;
    if (packet.size() < size) return {};
    const auto value = static_cast<std::int16_t>(size == 3 ? packet[1] << 8 | packet[2] : packet[1]);
    if (id == bumps_id)
      out.bumps = packet[1];
    else if (id == distance_id)
      out.distance = value;
    else if (id == angle_id)
      out.angle = value;
    else if (id == buttons_id)
      out.buttons = packet[1];
    else
      return {};
    packet = packet.subspan(size);
  }
  return out;
}

}  // namespace create_minimal
