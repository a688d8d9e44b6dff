// What was done by whom: records that one thread writes into a file. Layer: server/access.
#pragma once

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <deque>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "core/support/error.hpp"
#include "server/access/audit_config.hpp"
#include "server/access/audit_file.hpp"
#include "server/access/audit_record.hpp"

namespace rrgate {

/// May be used from any thread; none but its own waits for the disk, open() and the destructor apart. Records that
/// can't be written wait, up to max_waiting_bytes; above, they are lost and counted. Writing is tried again each
/// second.
class AuditLog {
 public:
  static constexpr std::size_t max_waiting_bytes = 8u * 1024 * 1024;
  struct State {
    std::string failure = {};   ///< why nothing can be written; empty: it can
    std::string found = {};     ///< what was wrong with the file when it was opened; empty: nothing
    AuditChain chain = {};      ///< of what is written
    std::uint64_t records = 0;  ///< that were written
    std::uint64_t lost = 0;     ///< that were not, and will not be
    std::uint64_t refused = 0;  ///< what admit() has refused
    std::size_t waiting = 0;    ///< records
  };

  AuditLog() = default;
  AuditLog(const AuditLog&) = delete;
  AuditLog& operator=(const AuditLog&) = delete;
  /// Writes what waits, and that it has stopped.
  ~AuditLog();

  /// Opens the file, or with another configuration another one; the same goes on. "" closes alone.
  /// Errors   io_error: then what was open stays so.
  [[nodiscard]] rr::Result<> open(const AuditConfig& config);
  /// The same path anew, which may be another file by now. Errors   as above.
  [[nodiscard]] rr::Result<> reopen();
  bool is_used() const { return is_used_; }
  /// Whether what will be recorded may be done. Errors   out_of_system_resource: not with fails_closed, while records
  /// can't be written; a sentence for the client.
  [[nodiscard]] rr::Result<> admit();
  void add(const AuditEvent& event);
  State state() const;
  /// Waits until all is written, or the time is over. Returns whether it is.
  bool flush(std::chrono::milliseconds time);

 private:
  void run();
  /// With the lock: adds a record, or counts it as lost.
  void put(std::string record);
  /// With the lock.
  void note_written(const rr::Result<>& result, std::size_t count);
  void write_now(std::string_view event, std::string_view detail);

  mutable std::mutex mutex_;
  std::condition_variable news_;
  std::condition_variable idle_;
  std::deque<std::string> waiting_;
  std::size_t waiting_bytes_ = 0;
  State state_;
  AuditConfig config_;
  std::chrono::steady_clock::time_point failing_since_{};
  std::uint64_t lost_before_ = 0;     ///< what of `lost` the log itself tells already
  std::uint64_t refused_before_ = 0;  ///< the same of `refused`
  bool is_stopping_ = false;
  std::atomic<bool> is_used_ = false;

  std::mutex file_mutex_;  ///< taken before mutex_, never behind it
  AuditFile file_;
  std::thread writer_;
};

}  // namespace rrgate
