#include "server/access/audit_file.hpp"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <optional>
#include <utility>

namespace rrgate {

namespace {

/// No record is longer.
constexpr std::uint64_t tail_bytes = 64 * 1024;

std::string system_text() {
  return std::strerror(errno);  // NOLINT(concurrency-mt-unsafe): glibc has a buffer for each thread
}

/// The last whole line, and where it ends in the file.
struct Tail {
  std::string line;
  std::uint64_t end = 0;
};

Tail read_tail(const std::string& path, std::uint64_t size) {
  const int file = ::open(path.c_str(), O_RDONLY | O_CLOEXEC);
  if (file < 0) return {{}, size};
  const auto begin = size > tail_bytes ? size - tail_bytes : 0;
  std::string text(static_cast<std::size_t>(size - begin), '\0');
  const auto got = ::pread(file, text.data(), text.size(), static_cast<off_t>(begin));
  ::close(file);
  text.resize(static_cast<std::size_t>(std::max<ssize_t>(got, 0)));
  const auto end = text.rfind('\n');
  if (end == std::string::npos) return {{}, begin == 0 ? 0 : size};
  const auto before = end == 0 ? std::string::npos : text.rfind('\n', end - 1);
  const auto first = before == std::string::npos ? 0 : before + 1;
  return {text.substr(first, end - first), begin + end + 1};
}

/// nullopt: there is none, or nothing in it.
std::optional<AuditChain> read_head(int file) {
  char text[128] = {};
  unsigned long long seq = 0;
  char hash[65] = {};
  if (file < 0 || ::pread(file, text, sizeof(text) - 1, 0) <= 0 || std::sscanf(text, "%20llu %64s", &seq, hash) != 2)
    return std::nullopt;
  return AuditChain{seq, hash};
}

}  // namespace

AuditFile& AuditFile::operator=(AuditFile&& other) noexcept {
  std::swap(config_, other.config_);
  std::swap(chain_, other.chain_);
  std::swap(file_, other.file_);
  std::swap(head_, other.head_);
  std::swap(is_regular_, other.is_regular_);
  std::swap(size_, other.size_);
  std::swap(is_new_, other.is_new_);
  std::swap(begins_line_, other.begins_line_);
  std::swap(found_, other.found_);
  return *this;
}

AuditFile::~AuditFile() {
  if (file_ >= 0) ::close(file_);
  if (head_ >= 0) ::close(head_);
}

rr::Result<int> AuditFile::open_file(const std::string& path, int flags) const {
  const int opened = ::open(path.c_str(), flags | O_CREAT | O_CLOEXEC | O_NOCTTY, 0600);
  if (opened < 0)
    return rr::make_error(rr::ErrorCode::io_error, "audit file " + rr::quote(path, 200) + ": " + system_text());
  return opened;
}

rr::Result<AuditFile> AuditFile::open(const AuditConfig& config) {
  AuditFile out;
  out.config_ = config;
  if (auto opened = out.reopen(); !opened) return opened.error();
  if (out.is_regular_) out.find_chain();
  return out;
}

rr::Result<> AuditFile::reopen() {
  const auto opened = open_file(config_.file, O_WRONLY | O_APPEND);
  if (!opened) return opened.error();
  struct stat about {};
  ::fstat(*opened, &about);
  const bool is_regular = S_ISREG(about.st_mode);
  if (is_regular && head_ < 0)
    if (const auto head = open_file(config_.file + ".head", O_RDWR)) head_ = *head;
  // Whoever adds to it without knowing of the other breaks the chain of both.
  if (is_regular && ::flock(head_ >= 0 ? head_ : *opened, LOCK_EX | LOCK_NB) != 0) {
    ::close(*opened);
    return rr::make_error(rr::ErrorCode::io_error, "audit file " + rr::quote(config_.file, 200) +
                                                       ": another gateway writes it; expected one for each file");
  }
  if (const int old = std::exchange(file_, *opened); old >= 0) ::close(old);
  is_regular_ = is_regular;
  size_ = is_regular_ ? static_cast<std::uint64_t>(about.st_size) : 0;
  if (size_ == 0) is_new_ = begins_line_ = true;
  return {};
}

void AuditFile::find_chain() {
  const auto tail = read_tail(config_.file, size_);
  if (tail.end < size_) {
    found_ = "the last line was not whole: " + std::to_string(size_ - tail.end) + " bytes were cut off";
    if (::ftruncate(file_, static_cast<off_t>(tail.end)) == 0)
      size_ = tail.end;
    else
      begins_line_ = false;
  }
  const auto last = parse_audit_line(tail.line);
  if (last) chain_ = {last->seq, last->hash};
  const auto head = read_head(head_);
  const bool was_cut =
      head && (head->seq > chain_.seq || (head->seq == chain_.seq && head->seq != 0 && *head != chain_));
  if (was_cut) {
    found_ = "the file ends with record " + std::to_string(chain_.seq) + ", but " + std::to_string(head->seq) +
             " were written: its end was cut off, or another file is there";
    chain_ = *head;
  } else if (last && !head) {
    found_ = config_.file + ".head is missing: the end of the file may have been cut off";
  } else if (last && last->text.find(",\"event\":\"stopped\"") == std::string_view::npos && found_.empty()) {
    found_ = "the gateway before was killed, or the end of the file was cut off: there is no \"stopped\"";
  }
}

rr::Result<> AuditFile::rotate() {
  const auto name = [this](std::size_t number) { return config_.file + "." + std::to_string(number); };
  // Where it has been renamed, by this before it could not be opened anew or by somebody else, there is nothing left to
  // do: each further shift would cost the oldest file.
  struct stat about {};
  if (::lstat(config_.file.c_str(), &about) != 0) return reopen();
  for (auto number = config_.keep; number > 1; --number) ::rename(name(number - 1).c_str(), name(number).c_str());
  if (::rename(config_.file.c_str(), name(1).c_str()) != 0 && errno != ENOENT)
    return rr::make_error(rr::ErrorCode::io_error,
                          "audit file " + rr::quote(config_.file, 200) + " can't be renamed: " + system_text());
  return reopen();
}

rr::Result<> AuditFile::append(std::string_view text) {
  std::size_t done = 0;
  while (done < text.size()) {
    const auto written = ::write(file_, text.data() + done, text.size() - done);
    if (written < 0 && errno == EINTR) continue;
    if (written <= 0) {
      auto failed = rr::make_error(rr::ErrorCode::io_error, system_text());
      if (done > 0) begins_line_ = is_regular_ && ::ftruncate(file_, static_cast<off_t>(size_)) == 0;
      return failed;
    }
    done += static_cast<std::size_t>(written);
  }
  size_ += text.size();
  begins_line_ = true;
  return {};
}

rr::Result<> AuditFile::write(std::span<const std::string> records) {
  const auto seal = [&](AuditChain& chain) {
    std::string text = begins_line_ ? "" : "\n";
    bool is_first = is_new_;
    for (const auto& record : records) text += chain.add(record, std::exchange(is_first, false));
    return text;
  };
  auto chain = chain_;
  auto text = seal(chain);
  if (is_regular_ && config_.max_bytes > 0 && size_ > 0 && size_ + text.size() > config_.max_bytes) {
    if (auto rotated = rotate(); !rotated) return rotated;
    chain = chain_;
    text = seal(chain);
  }
  if (auto done = append(text); !done) return done;
  if (config_.syncs && is_regular_ && ::fdatasync(file_) != 0) {
    auto failed = rr::make_error(rr::ErrorCode::io_error, "fdatasync: " + system_text());
    if (::ftruncate(file_, static_cast<off_t>(size_ - text.size())) == 0) size_ -= text.size();
    return failed;
  }
  chain_ = chain;
  is_new_ = false;
  note_head();
  return {};
}

/// Of always the same length, so that it has room on a full disk too.
void AuditFile::note_head() const {
  if (head_ < 0) return;
  char text[96];
  const int size = std::snprintf(text, sizeof(text), "%020llu %s\n", static_cast<unsigned long long>(chain_.seq),
                                 chain_.hash.c_str());
  if (::pwrite(head_, text, static_cast<std::size_t>(size), 0) == size && config_.syncs) ::fdatasync(head_);
}

}  // namespace rrgate
