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

Result<LockedFile> LockedFile::open(const fs::path& path) {
  const int descriptor = ::open(path.c_str(), O_RDWR | O_CREAT | O_CLOEXEC | O_NOFOLLOW, 0640);
  if (descriptor < 0) return make_error(ErrorCode::system_resource_error, "open " + path.string() + ": " + reason());
  ::fchmod(descriptor, 0640);  // whatever the umask says: the group of a public node reads it
  LockedFile file(descriptor, path);
  auto lock = whole_file();
  if (::fcntl(descriptor, F_OFD_SETLK, &lock) != 0) {
    if (errno == EAGAIN || errno == EACCES)
      return make_error(ErrorCode::system_resource_permission_denied, path.string() + " is in use by another node");
    return file.failure("lock");
  }
  return file;
}

bool LockedFile::is_held(const fs::path& path) {
  // To read only: other users' nodes let no more, and who watches the folder would take our closing for news.
  const int descriptor = ::open(path.c_str(), O_RDONLY | O_NONBLOCK | O_NOFOLLOW | O_CLOEXEC);
  if (descriptor < 0) return false;
  auto lock = whole_file();
  const bool is_known = ::fcntl(descriptor, F_OFD_GETLK, &lock) == 0;
  ::close(descriptor);
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
  if (::ftruncate(descriptor_, 0) != 0) return failure("truncate");
  const auto written = ::pwrite(descriptor_, text.data(), text.size(), 0);
  if (written < 0 || static_cast<std::size_t>(written) != text.size()) return failure("write");
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
