// Which rrgate this is. Layer: server/config.
#pragma once

namespace rrgate {

/// "1.2.3"; of the project in CMakeLists.txt.
extern const char* const version;

}  // namespace rrgate
