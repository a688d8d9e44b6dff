// What was done by whom: one JSON object a line, added to the end of a file. Layer: server/access.
#pragma once

#include <chrono>
#include <mutex>
#include <string>
#include <string_view>

#include "core/support/error.hpp"
#include "server/access/access_rules.hpp"

namespace rrgate {

/// One line: {"time","event","user","roles","proof","client","device_user", and what else there is}.
struct AuditEvent {
  std::string_view event = {};  ///< "write", "call", "lock", "login", "login_failed", "refused", ...
  const Identity* who = nullptr;
  const AccessRequest* what = nullptr;  ///< null: nothing in particular
  std::string_view detail = {};         ///< why, in words; empty: no more to say
};

std::string format_audit_line(const AuditEvent& event, std::chrono::system_clock::time_point now);

/// May be written to from any thread. Nothing is lost when the file is renamed: reopen() begins a new one. A disk that
/// is full costs lines, never the program.
class AuditLog {
 public:
  AuditLog() = default;
  AuditLog(const AuditLog&) = delete;
  AuditLog& operator=(const AuditLog&) = delete;
  ~AuditLog();

  /// Closes what is open and opens `path` with mode 0600, made where it is not there; "" closes alone.
  /// Errors   io_error: then what was open stays so.
  [[nodiscard]] rr::Result<> open(const std::string& path);
  [[nodiscard]] rr::Result<> reopen();
  /// Whether the line is in the file, or there is none.
  bool write(const AuditEvent& event);
  std::uint64_t lost_lines() const;

 private:
  mutable std::mutex mutex_;
  std::string path_;
  int file_ = -1;
  std::uint64_t lost_ = 0;
  bool begins_line_ = true;  ///< false: the last line was cut
};

}  // namespace rrgate
