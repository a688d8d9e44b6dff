// Recordings that the gateway has made, as agents read them. Layer: server/mcp. See docs/mcp.md.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "server/json/json.hpp"
#include "server/record/recording.hpp"

namespace rrgate {

/// URIs: "rrgate-recording://NAME" is a recording, "rrgate-recording://NAME/SERVICE/OBJECT/MEMBER" what is recorded of
/// a member.
inline constexpr std::string_view recording_scheme = "rrgate-recording://";

/// What is read of a recording, for any thread.
struct RecordingReading {
  std::vector<std::string> files = {};  ///< paths, in the order of time
  std::string topic = {};               ///< "/Create/state"; empty: which members there are

  /// The members with the number of their values; of one member, what `watch` tells of a wire. Files that have gone
  /// since are left out. Errors   member_not_found; data_serialization_error: what is wrong with which file.
  rr::Result<rr::OrderedJson> read() const;
};

}  // namespace rrgate
