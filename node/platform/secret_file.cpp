#include "node/platform/secret_file.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

namespace rr {

namespace fs = std::filesystem;

Result<> write_secret(const fs::path& path, std::string_view text, bool may_replace) {
  std::error_code error;
  if (!path.parent_path().empty() && !fs::exists(path.parent_path(), error)) {
    fs::create_directories(path.parent_path(), error);
    fs::permissions(path.parent_path(), fs::perms::owner_all, error);
  }
  if (!may_replace && fs::exists(path, error))
    return make_error(ErrorCode::operation_failed, path.string() + ": is there already; --force replaces it");
  const auto fresh = path.string() + ".new";
  ::unlink(fresh.c_str());
  const int file = ::open(fresh.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0600);
  bool is_written = file >= 0;
  if (is_written) {
    struct stat before {};
    if (::stat(path.c_str(), &before) == 0 && (before.st_uid != ::geteuid() || before.st_gid != ::getegid()))
      is_written = ::fchown(file, before.st_uid, before.st_gid) == 0;
    is_written = is_written && ::write(file, text.data(), text.size()) == static_cast<ssize_t>(text.size()) &&
                 ::fsync(file) == 0;
    ::close(file);
  }
  if (is_written) is_written = ::rename(fresh.c_str(), path.c_str()) == 0;
  if (!is_written) {
    ::unlink(fresh.c_str());
    return make_error(ErrorCode::io_error, path.string() + ": can't be written");
  }
  return {};
}

}  // namespace rr
