// Whether files of the audit log are as they were written. Layer: server/access.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "core/support/error.hpp"
#include "server/access/audit_record.hpp"

namespace rrgate {

struct AuditFinding {
  std::string file;
  std::uint64_t line = 0;
  std::string found;
  std::string expected;
};

struct AuditTrail {
  std::vector<AuditFinding> findings = {};
  std::uint64_t records = 0;
  std::uint64_t first = 0;      ///< number of the first record; 0: there is none
  AuditChain last = {};         ///< the last record
  std::uint64_t unchained = 0;  ///< lines before record 1, of versions that had no chain
};

/// In the order of their records, without those that only name the last one. Errors   io_error: which can't be read.
rr::Result<std::vector<std::string>> sort_audit_files(std::vector<std::string> files);

/// Checks the chain through all files, in any order, and that the record which FILE.head names is there. Without one
/// the end may have been cut off; files that were renamed to FILE.1, FILE.2, ... have none.
/// Errors   io_error: which can't be read.
rr::Result<AuditTrail> verify_audit_files(const std::vector<std::string>& files);

}  // namespace rrgate
