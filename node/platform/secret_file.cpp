#include "node/platform/secret_file.hpp"

#include <sys/stat.h>
#include <unistd.h>

#include "node/platform/replace_file.hpp"

namespace rr {

namespace fs = std::filesystem;

namespace {

/// Whose a new file is to be, and with which mode.
struct Keeper {
  uid_t user = ::geteuid();
  gid_t group = ::getegid();
  mode_t mode = 0;
};

/// `alone` for the owner; where root writes into a folder of another group, that of the folder and `with_group`.
Keeper keeper_in(const fs::path& folder, mode_t alone, mode_t with_group) {
  Keeper keeper{.mode = alone};
  struct stat about {};
  if (::geteuid() != 0 || ::stat(folder.empty() ? "." : folder.c_str(), &about) != 0) return keeper;
  if (about.st_gid == 0 || (about.st_mode & S_IXGRP) == 0 || (about.st_mode & S_IWOTH) != 0) return keeper;
  return {about.st_uid, about.st_gid, with_group};
}

void make_secret_folder(const fs::path& folder) {
  std::error_code error;
  if (folder.empty() || fs::exists(folder, error)) return;
  const auto keeper = keeper_in(folder.parent_path(), S_IRWXU, S_IRWXU | S_IRGRP | S_IXGRP);
  fs::create_directories(folder, error);
  fs::permissions(folder, static_cast<fs::perms>(keeper.mode), error);
  // Where that fails, so does writing, or the service says what it can't read.
  if (keeper.group != ::getegid() && ::chown(folder.c_str(), keeper.user, keeper.group) != 0) return;
}

bool give_away(int file, const Keeper& keeper) {
  const bool is_own = keeper.user == ::geteuid() && keeper.group == ::getegid();
  return (is_own || ::fchown(file, keeper.user, keeper.group) == 0) && ::fchmod(file, keeper.mode) == 0;
}

}  // namespace

Result<> write_secret(const fs::path& path, std::string_view text, bool may_replace, SecretReaders readers) {
  std::error_code error;
  make_secret_folder(path.parent_path());
  if (!may_replace && fs::exists(path, error))
    return make_error(ErrorCode::operation_failed, path.string() + ": is there already; --force replaces it");
  auto keeper = readers == SecretReaders::folder_group
                    ? keeper_in(path.parent_path(), S_IRUSR | S_IWUSR, S_IRUSR | S_IWUSR | S_IRGRP)
                    : Keeper{.mode = S_IRUSR | S_IWUSR};
  if (struct stat before{}; ::stat(path.c_str(), &before) == 0)
    keeper = {before.st_uid, before.st_gid, S_IRUSR | S_IWUSR | (before.st_mode & S_IRGRP)};
  if (!replace_file(path, text, [&keeper](int file) { return give_away(file, keeper); }))
    return make_error(ErrorCode::io_error, path.string() + ": can't be written");
  return {};
}

}  // namespace rr
