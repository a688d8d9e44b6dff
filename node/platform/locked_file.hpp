// A file that one process at a time may hold. Layer: node/platform. Source: transports spec section 8.2 (locks).
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

#include "core/support/error.hpp"

namespace rr {

/// Opens a file that anybody may have put there: a pipe doesn't make us wait, a link doesn't lead elsewhere. -1: it
/// can't be opened, as when it is not there. Errors   out_of_system_resource: there is no descriptor or memory left for
/// it.
[[nodiscard]] Result<int> open_to_read(const std::filesystem::path& path);
/// out_of_system_resource where that is what `reason`, an errno, says of `path`.
[[nodiscard]] std::optional<Error> shortage(int reason, const std::filesystem::path& path);

/// Held by a record lock of the open file, which excludes the reference's locks and, unlike those, survives that this
/// process opens and closes the file elsewhere.
class LockedFile {
 public:
  /// Opens or creates it, mode 01640, and locks it. Its content stays as it is.
  /// Errors   system_resource_permission_denied: another node holds it; system_resource_error: it can't be opened.
  [[nodiscard]] static Result<LockedFile> open(const std::filesystem::path& path);
  /// The same for a file that is there. Errors   also system_resource_error: it is not, or is removed meanwhile.
  [[nodiscard]] static Result<LockedFile> open_left_behind(const std::filesystem::path& path);
  /// Whether somebody holds the lock of a file. Not there: no. Errors   those of open_to_read().
  [[nodiscard]] static Result<bool> is_held(const std::filesystem::path& path);

  LockedFile(LockedFile&& other) noexcept
      : descriptor_(std::exchange(other.descriptor_, -1)), path_(std::move(other.path_)) {}
  LockedFile& operator=(LockedFile&& other) noexcept;
  ~LockedFile();

  /// Replaces the content. Others that read it meanwhile may see the new text with what was behind it in the old one.
  [[nodiscard]] Result<> write(std::string_view text);
  /// At most `limit` bytes of the content.
  [[nodiscard]] Result<std::string> read(std::size_t limit) const;
  /// Deletes the file; the lock is held until the end of this object.
  void remove();

 private:
  LockedFile(int descriptor, std::filesystem::path path) : descriptor_(descriptor), path_(std::move(path)) {}
  static Result<LockedFile> open_once(const std::filesystem::path& path, int flags);
  bool is_still_there() const;
  Error failure(const char* what) const;

  int descriptor_;
  std::filesystem::path path_;
};

}  // namespace rr
