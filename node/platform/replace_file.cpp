#include "node/platform/replace_file.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <cstdlib>
#include <string>

namespace rr {

namespace {

bool write_whole(int file, std::string_view text) {
  while (!text.empty()) {
    const auto written = ::write(file, text.data(), text.size());
    if (written <= 0) return false;
    text.remove_prefix(static_cast<std::size_t>(written));
  }
  return ::fsync(file) == 0;
}

}  // namespace

bool replace_file(const std::filesystem::path& path, std::string_view text,
                  const std::function<bool(int file)>& prepare) {
  auto fresh = path.string() + ".XXXXXX";
  const int file = ::mkostemp(fresh.data(), O_CLOEXEC);
  if (file < 0) return false;
  const bool is_complete = prepare(file) && write_whole(file, text);
  ::close(file);
  if (is_complete && ::rename(fresh.c_str(), path.c_str()) == 0) return true;
  ::unlink(fresh.c_str());
  return false;
}

}  // namespace rr
