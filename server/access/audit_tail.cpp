#include "server/access/audit_tail.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <set>
#include <string_view>
#include <utility>

#include "core/support/glob.hpp"
#include "server/access/audit_record.hpp"

namespace rrgate {

namespace {

constexpr std::size_t block_bytes = 64 * 1024;
constexpr std::size_t most_tail_bytes = 8 * 1024 * 1024;

std::string member_of(const rr::Json& record, const char* key) {
  const auto found = record.find(key);
  return found != record.end() && found->is_string() ? found->get<std::string>() : std::string();
}

/// Open for as long as this is there.
class TailFile {
 public:
  explicit TailFile(const std::string& path)
      : file_(::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK | O_NOCTTY)) {
    struct stat about {};
    if (file_ < 0 || ::fstat(file_, &about) != 0) return;
    is_regular_ = S_ISREG(about.st_mode);
    size_ = static_cast<std::size_t>(about.st_size);
  }
  TailFile(const TailFile&) = delete;
  TailFile& operator=(const TailFile&) = delete;
  ~TailFile() {
    if (file_ >= 0) ::close(file_);
  }

  bool is_open() const { return file_ >= 0; }
  bool is_regular() const { return is_regular_; }
  std::size_t size() const { return size_; }
  /// Empty: it has become shorter, or can't be read.
  std::string read(std::size_t from, std::size_t count) const {
    std::string out(count, '\0');
    const auto got = ::pread(file_, out.data(), count, static_cast<off_t>(from));
    if (got != static_cast<ssize_t>(count)) out.clear();
    return out;
  }

 private:
  int file_;
  bool is_regular_ = false;
  std::size_t size_ = 0;
};

class TailReader {
 public:
  TailReader(const AuditFilter& filter, std::size_t limit) : filter_(filter), limit_(limit) {}

  /// False: that is enough.
  bool read(const TailFile& file) {
    std::string rest;  // the end of a line whose beginning is in a block before
    for (auto end = file.size(); end > 0;) {
      if (left_ == 0) return stop();
      const auto size = std::min({block_bytes, end, left_});
      auto text = file.read(end - size, size);
      if (text.empty()) return stop();
      end -= size;
      left_ -= size;
      text += rest;
      for (auto at = text.rfind('\n'); at != std::string::npos; at = text.rfind('\n')) {
        if (!take(std::string_view(text).substr(at + 1))) return stop();
        text.resize(at);
      }
      rest = std::move(text);
    }
    return take(rest) || stop();
  }

  AuditTail out;

 private:
  bool stop() {
    out.is_all = false;
    return false;
  }

  /// False: it fits, and there is no room for it.
  bool take(std::string_view line) {
    const auto parsed = parse_audit_line(line);
    if (!parsed) return true;
    const auto record = rr::read_json(line);
    if (!record || !record->is_object() || !filter_.fits(*record)) return true;
    // A file that was renamed meanwhile is met again under its new name.
    if (seen_.contains(parsed->hash)) return true;
    if (out.records.size() == limit_) return false;
    seen_.insert(parsed->hash);
    out.records.emplace_back(line);
    return true;
  }

  const AuditFilter& filter_;
  std::size_t limit_;
  std::size_t left_ = most_tail_bytes;
  std::set<std::string> seen_;  ///< hashes
};

}  // namespace

bool AuditFilter::fits(const rr::Json& record) const {
  const auto matches = [&](const std::string& pattern, const char* key) {
    return pattern.empty() || rr::glob_matches(pattern, member_of(record, key));
  };
  return (matches(user, "user") || matches(user, "device_user")) && matches(device, "device") &&
         matches(member, "member") && matches(outcome, "outcome") && matches(face, "face") &&
         member_of(record, "time") >= since;
}

rr::Result<AuditTail> read_audit_tail(const AuditConfig& config, const AuditFilter& filter, std::size_t limit) {
  TailReader reader(filter, limit);
  for (std::size_t number = 0; number <= config.keep; ++number) {
    const auto path = number == 0 ? config.file : config.file + "." + std::to_string(number);
    const TailFile file(path);
    if (!file.is_open()) {
      if (number > 0) break;
      const std::string why = std::strerror(errno);  // NOLINT(concurrency-mt-unsafe): glibc has one for each thread
      return rr::make_error(rr::ErrorCode::io_error, "audit file " + rr::quote(path, 200) + ": " + why);
    }
    if (!file.is_regular())
      return rr::make_error(
          rr::ErrorCode::invalid_state,
          "the audit log is no regular file, and can't be read from here; its records are where \"file\" "
          "of \"audit\" leads");
    if (!reader.read(file)) break;
  }
  return std::move(reader.out);
}

}  // namespace rrgate
