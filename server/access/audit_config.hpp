// What an operator says about the record of what is done. Layer: server/access. Mirrors "audit" of gateway.schema.json.
#pragma once

#include <cstddef>
#include <string>

namespace rrgate {

struct AuditConfig {
  std::string file = {};      ///< empty: no audit log
  std::size_t max_bytes = 0;  ///< a file that would grow above it is renamed, and a new one begun; 0: never
  std::size_t keep = 10;      ///< renamed files: FILE.1, the newest, to FILE.10
  bool syncs = false;         ///< records are on the disk before the next are written
  /// What would be recorded is refused as long as records can't be written.
  bool fails_closed = false;

  bool operator==(const AuditConfig&) const = default;
};

}  // namespace rrgate
