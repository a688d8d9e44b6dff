// The newest records of the audit log, and which records somebody wants to see. Layer: server/access.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "core/support/error.hpp"
#include "server/access/audit_config.hpp"
#include "server/json/json.hpp"

namespace rrgate {

/// Patterns as in rules; empty fits everything.
struct AuditFilter {
  std::string user = {};  ///< of the gateway or of a device
  std::string device = {};
  std::string member = {};
  std::string outcome = {};
  std::string face = {};
  std::string since = {};  ///< no pattern: a time as records have it, or its beginning

  bool fits(const rr::Json& record) const;
};

struct AuditTail {
  std::vector<std::string> records = {};  ///< lines without '\n', each a JSON object; the newest first
  bool is_all = true;                     ///< false: there may be older ones that fit
};

/// Reads backwards from the end of the file, and goes on with FILE.1, FILE.2, ... that were renamed. Waits for the
/// disk. Ends after `limit` records that fit, and after at most 8 MiB. Errors   io_error: the file can't be read;
/// invalid_state: it is none that can be read backwards, such as a pipe.
rr::Result<AuditTail> read_audit_tail(const AuditConfig& config, const AuditFilter& filter, std::size_t limit);

}  // namespace rrgate
