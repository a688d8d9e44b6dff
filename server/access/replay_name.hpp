// The names of recordings, and of devices that play them: they say what was recorded, by whose rights both are used.
// Layer: server/access.
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "server/access/access_rules.hpp"

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

/// What "create.Create.20261125T083000123Z" says; borrows that.
struct RecordedPlace {
  std::string_view device;
  std::string_view service = {};
  std::string_view begin = {};
};

/// nullopt: it has no three parts. What they hold is not looked at.
inline std::optional<RecordedPlace> split_recording_name(std::string_view name) {
  const auto begin = name.rfind('.');
  const auto service = begin == std::string_view::npos ? begin : name.substr(0, begin).rfind('.');
  if (service == std::string_view::npos) return std::nullopt;
  return RecordedPlace{name.substr(0, service), name.substr(service + 1, begin - service - 1), name.substr(begin + 1)};
}

/// What a device plays, as its name says; borrows that. nullopt: the device plays no recording.
inline std::optional<RecordedPlace> played_by(std::string_view device) {
  if (!is_replay(device)) return std::nullopt;
  device.remove_prefix(replay_prefix.size());
  return split_recording_name(device).value_or(RecordedPlace{device});
}

/// What who controls the playing of it asks for.
inline AccessRequest to_record(const RecordedPlace& played) {
  return {.device = played.device, .service = played.service, .verb = Verb::record};
}

}  // namespace rrgate
