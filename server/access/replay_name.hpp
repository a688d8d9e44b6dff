// The names of devices that play recordings: they say what was recorded, by whose rights they are used. Layer:
// server/access.
#pragma once

#include <optional>
#include <string>
#include <string_view>

namespace rrgate {

/// No other device has such a name: '~' is in none that check_device_name() or rr::is_valid_node_name() takes.
inline constexpr std::string_view replay_prefix = "replay~";

/// Of the device that plays a recording's file: "replay~create.Create.20261125T083000123Z".
/// `file`  its name without ".mcap".
inline std::string replay_name(std::string_view file) {
  return std::string(replay_prefix) + std::string(file);
}

constexpr bool is_replay(std::string_view device) {
  return device.starts_with(replay_prefix);
}

struct RecordedPlace {
  std::string_view device;
  std::string_view service;
};

/// What a device plays, as its name says; borrows that. nullopt: the device plays no recording.
inline std::optional<RecordedPlace> played_by(std::string_view device) {
  if (!is_replay(device)) return std::nullopt;
  device.remove_prefix(replay_prefix.size());
  const auto time = device.rfind('.');
  const auto service = time == std::string_view::npos ? time : device.substr(0, time).rfind('.');
  if (service == std::string_view::npos) return RecordedPlace{device, {}};
  return RecordedPlace{device.substr(0, service), device.substr(service + 1, time - service - 1)};
}

}  // namespace rrgate
