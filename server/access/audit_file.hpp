// The file of the audit log: added to, renamed when it is large, its chain continued. Layer: server/access.
#pragma once

#include <cstdint>
#include <span>
#include <string>

#include "core/support/error.hpp"
#include "server/access/audit_config.hpp"
#include "server/access/audit_record.hpp"

namespace rrgate {

/// Used by one thread at a time. Beside a regular file FILE goes FILE.head, 86 bytes with the number and the hash of
/// the last record: what is cut off the end of FILE is missed when it is verified, and by the next start.
class AuditFile {
 public:
  /// Opens the file with mode 0600, made where it is not there, and finds where its chain has got to. While it is open,
  /// no other process can.
  /// Errors   io_error: can't be opened, or another gateway has it open.
  static rr::Result<AuditFile> open(const AuditConfig& config);
  AuditFile() = default;
  AuditFile(AuditFile&& other) noexcept { *this = std::move(other); }
  AuditFile& operator=(AuditFile&& other) noexcept;
  ~AuditFile();

  /// The same path anew: it was renamed, or is gone. The chain goes on. Errors   io_error: what was open stays so.
  rr::Result<> reopen();
  /// Writes the records, all or none. Errors   io_error: what the system says.
  rr::Result<> write(std::span<const std::string> records);

  bool is_open() const { return file_ >= 0; }
  const AuditConfig& config() const { return config_; }
  /// The path stays as it is.
  void set_config(const AuditConfig& config) { config_ = config; }
  const AuditChain& chain() const { return chain_; }
  /// What open() found to be wrong: a sentence; empty: nothing.
  const std::string& found() const { return found_; }

 private:
  rr::Result<int> open_file(const std::string& path, int flags) const;
  void find_chain();
  /// Renames the file and those that were renamed before.
  rr::Result<> rotate();
  /// Errors   io_error: then the file is as it was, as far as it can be.
  rr::Result<> append(std::string_view text);
  void note_head() const;

  AuditConfig config_;
  AuditChain chain_;
  int file_ = -1;
  int head_ = -1;  ///< -1: no regular file, or it can't be made
  bool is_regular_ = false;
  std::uint64_t size_ = 0;
  bool is_new_ = true;       ///< the next record is the first of the file or of a start
  bool begins_line_ = true;  ///< false: the last line was cut, and the piece can't be taken away
  std::string found_;
};

}  // namespace rrgate
