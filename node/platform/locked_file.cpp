#include "node/platform/locked_file.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <system_error>

namespace rr {

namespace fs = std::filesystem;

namespace {

std::string reason() {
  return std::generic_category().message(errno);
}

struct flock whole_file() {
  struct flock lock {};
  lock.l_type = F_WRLCK;
  lock.l_whence = SEEK_SET;
  return lock;
}

}  // namespace

std::optional<Error> shortage(int reason, const fs::path& path) {
  if (reason != EMFILE && reason != ENFILE && reason != ENOMEM) return std::nullopt;
  return make_error(ErrorCode::out_of_system_resource,
                    "open " + path.string() + ": " + std::generic_category().message(reason));
}

Result<int> open_to_read(const fs::path& path) {
  const int descriptor = ::open(path.c_str(), O_RDONLY | O_NONBLOCK | O_NOFOLLOW | O_CLOEXEC);
  if (descriptor < 0)
    if (auto error = shortage(errno, path)) return std::move(*error);
  return descriptor;
}

Result<LockedFile> LockedFile::open(const fs::path& path) {
  for (int attempts = 10; attempts > 0; --attempts) {
    auto file = open_once(path, O_CREAT);
    if (!file || file->is_still_there()) return file;
  }
  return make_error(ErrorCode::system_resource_error, path.string() + " is removed again and again");
}

Result<LockedFile> LockedFile::open_left_behind(const fs::path& path) {
  auto file = open_once(path, 0);
  if (file && !file->is_still_there())
    return make_error(ErrorCode::system_resource_error, path.string() + " was removed meanwhile");
  return file;
}

Result<LockedFile> LockedFile::open_once(const fs::path& path, int flags) {
  const int descriptor = ::open(path.c_str(), O_RDWR | O_CLOEXEC | O_NOFOLLOW | flags, 0640);
  if (descriptor < 0) return make_error(ErrorCode::system_resource_error, "open " + path.string() + ": " + reason());
  LockedFile file(descriptor, path);
  auto lock = whole_file();
  if (::fcntl(descriptor, F_OFD_SETLK, &lock) != 0) {
    if (errno == EAGAIN || errno == EACCES)
      return make_error(ErrorCode::system_resource_permission_denied, path.string() + " is in use by another node");
    return file.failure("lock");
  }
  // Whatever the umask says: the group of a public node reads it, and who deletes old files from /tmp leaves one with
  // a sticky bit alone (systemd-tmpfiles; XDG base directories).
  ::fchmod(descriptor, 01640);
  return file;
}

/// Not where another node, as it cleaned up, removed the path between our opening and our lock.
bool LockedFile::is_still_there() const {
  struct stat mine {};
  struct stat named {};
  return ::fstat(descriptor_, &mine) == 0 && ::stat(path_.c_str(), &named) == 0 && mine.st_dev == named.st_dev &&
         mine.st_ino == named.st_ino;
}

Result<bool> LockedFile::is_held(const fs::path& path) {
  // To read only: other users' nodes let no more, and who watches the folder would take our closing for news.
  const auto descriptor = open_to_read(path);
  if (!descriptor) return descriptor.error();
  if (*descriptor < 0) return false;
  auto lock = whole_file();
  const bool is_known = ::fcntl(*descriptor, F_OFD_GETLK, &lock) == 0;
  ::close(*descriptor);
  return is_known && lock.l_type != F_UNLCK;
}

LockedFile& LockedFile::operator=(LockedFile&& other) noexcept {
  std::swap(descriptor_, other.descriptor_);
  std::swap(path_, other.path_);
  return *this;
}

LockedFile::~LockedFile() {
  if (descriptor_ >= 0) ::close(descriptor_);
}

Error LockedFile::failure(const char* what) const {
  return make_error(ErrorCode::system_resource_error, std::string(what) + " " + path_.string() + ": " + reason());
}

Result<> LockedFile::write(std::string_view text) {
  // In this order: who reads it meanwhile, without the lock, may find the end of the old text, but never an empty file.
  const auto written = ::pwrite(descriptor_, text.data(), text.size(), 0);
  if (written < 0 || static_cast<std::size_t>(written) != text.size()) return failure("write");
  if (::ftruncate(descriptor_, written) != 0) return failure("truncate");
  return {};
}

Result<std::string> LockedFile::read(std::size_t limit) const {
  std::string text(limit, '\0');
  const auto size = ::pread(descriptor_, text.data(), limit, 0);
  if (size < 0) return failure("read");
  text.resize(static_cast<std::size_t>(size));
  return text;
}

void LockedFile::remove() {
  std::error_code ignored;
  fs::remove(path_, ignored);
}

}  // namespace rr
