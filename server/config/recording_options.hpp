// "recordings": what the gateway records of its devices, and where. Layer: server/config. See docs/recording.md.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

namespace rrgate {

class ObjectReader;

/// What is to be recorded of a service of a device.
struct RecordingWish {
  std::string device;
  std::string service;
  std::vector<std::string> members = {"*"};  ///< see RecorderOptions
  std::chrono::milliseconds interval{1000};  ///< between two readings of a property
  std::chrono::milliseconds duration{0};     ///< 0: until it is stopped
  std::size_t max_file_bytes = 0;            ///< then the next file begins; 0: no limit
  std::size_t kept_files = 0;                ///< the oldest go when there are more; 0: all stay

  bool operator==(const RecordingWish&) const = default;
};

struct RecordingsConfig {
  std::string folder;                        ///< empty: the gateway records nothing
  std::size_t max_bytes = 10'000'000'000;    ///< of all files in the folder
  std::size_t at_once = 16;                  ///< recordings that clients have begun
  std::vector<RecordingWish> standing = {};  ///< from the start on, as long as the gateway runs

  bool operator==(const RecordingsConfig&) const = default;
};

void read_recordings(ObjectReader& in, RecordingsConfig& recordings);

}  // namespace rrgate
