// Which URL schemes a device may have. Layer: node/transport. Kept apart from dial.hpp, which needs Asio.
#pragma once

#include <chrono>
#include <string>
#include <string_view>

#include "core/session/url.hpp"

namespace rr {

bool can_dial(std::string_view scheme);
/// "rr+tcp, ..." for messages.
std::string dialable_schemes();

/// How a session sees that its peer is gone: after `period` of silence it asks, and waits `timeout` for an answer.
struct Heartbeat {
  std::chrono::milliseconds period{10'000};
  std::chrono::milliseconds timeout{15'000};
  bool operator==(const Heartbeat&) const = default;
};
/// What the reference does on the transport. A service takes 1.2 times the period, so that the client asks first.
Heartbeat heartbeat_of(std::string_view scheme);

}  // namespace rr
