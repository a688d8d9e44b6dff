#include "core/support/random.hpp"

#include <random>

namespace rr {

std::uint32_t random_u32() {
  // Opened once: on Linux every std::random_device opens its source anew. It is stateless, so sharing it shares
  // nothing.
  thread_local std::random_device source;
  return source();
}

NodeId random_node_id() {
  NodeId id;
  for (std::size_t i = 0; i < id.bytes.size(); i += 4) {
    const auto word = random_u32();
    for (std::size_t j = 0; j < 4; ++j) id.bytes[i + j] = static_cast<std::uint8_t>(word >> (8 * j));
  }
  id.bytes[6] = static_cast<std::uint8_t>((id.bytes[6] & 0x0f) | 0x40);
  id.bytes[8] = static_cast<std::uint8_t>((id.bytes[8] & 0x3f) | 0x80);
  return id;
}

std::uint32_t random_endpoint() {
  while (true)
    if (const auto endpoint = random_u32()) return endpoint;
}

std::chrono::milliseconds random_between(std::chrono::milliseconds least, std::chrono::milliseconds most) {
  const auto choices = static_cast<std::uint32_t>((most - least).count()) + 1;
  return least + std::chrono::milliseconds(random_u32() % choices);
}

}  // namespace rr
