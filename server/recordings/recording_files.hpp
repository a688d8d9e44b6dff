// The folder that a gateway records into: which files are of which recording, and which ones make room for others.
// Layer: server/recordings.
#pragma once

#include <chrono>
#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "server/config/recording_options.hpp"

namespace rrgate {

struct RecordingFile {
  std::string name;
  std::uint64_t bytes = 0;
  std::chrono::system_clock::time_point written;  ///< last
};

/// "create.Create.20261125T083000123Z"
struct RecordingName {
  std::string device;
  std::string service;
  std::chrono::system_clock::time_point begin;
};
std::string format_recording_name(const RecordingName& name);
/// nullopt: it is none.
std::optional<RecordingName> parse_recording_name(std::string_view name);

/// The first file of a recording.
std::string first_file_of(std::string_view recording);
/// The recording that a file of this name is of; empty: of none.
std::string recording_of_file(std::string_view file);

/// The device that plays a recording.
std::string replay_of(std::string_view recording);
/// The device that plays one file of a recording alone: "replay~NAME-1", "replay~NAME-2". Empty: of no recording.
std::string replay_of_file(std::string_view file);
/// The recording that a device plays, or a file of which; empty: it plays none.
std::string recording_of_replay(std::string_view device);

/// Of recordings by their names, each list oldest first.
using RecordingFiles = std::map<std::string, std::vector<RecordingFile>, std::less<>>;
/// `recording`  whose files are looked for; empty: of all. What can't be read is left out.
RecordingFiles look_into(const std::string& folder, std::string_view recording);

/// A ring is what the configuration wants in so many files at most; they outlive the gateway. Files say whose they are
/// by the members that they have. Empty: it is none.
std::string ring_of(const RecordingWish& standing);
/// Paths of its files that are there, oldest first: also those of a ring of the same service that nobody wants any
/// more. Those without a message, as a gateway that is killed leaves them, are deleted instead. `standing`  all that
/// the configuration wants. `under_way`  recordings whose files are left out.
std::deque<std::string> find_ring(const std::string& folder, const RecordingWish& wish,
                                  const std::vector<RecordingWish>& standing, const std::set<std::string>& under_way);

}  // namespace rrgate
