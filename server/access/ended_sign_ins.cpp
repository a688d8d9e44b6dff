#include "server/access/ended_sign_ins.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdint>
#include <cstring>
#include <filesystem>

#include "core/support/whole_number.hpp"
#include "core/support/words.hpp"
#include "node/platform/secret_file.hpp"
#include "node/platform/text_file.hpp"

namespace rrgate {

namespace fs = std::filesystem;

namespace {

/// More than SpentSeals::most lines have.
constexpr std::uintmax_t much_text = 8 * 1024 * 1024;

std::int64_t in_milliseconds(EndedSignIn::Time time) {
  return std::chrono::floor<std::chrono::milliseconds>(time.time_since_epoch()).count();
}

/// A line of its own, also behind half of one.
std::string format_line(const EndedSignIn& ended) {
  return "\n" + ended.id + " " + std::to_string(in_milliseconds(ended.ends)) + " " + ended.subject + "\n";
}

}  // namespace

std::vector<EndedSignIn> read_ended_sign_ins(const std::string& file, EndedSignIn::Time now) {
  std::vector<EndedSignIn> out;
  const auto whole = read_text_file(file).value_or("");
  for (std::string_view text = whole; !text.empty();) {
    const auto end = std::min(text.find('\n'), text.size());
    const auto fields = rr::split_words(text.substr(0, end));
    text.remove_prefix(std::min(end + 1, text.size()));
    const auto ends = fields.size() == 3 ? rr::whole_number<std::int64_t>(fields[1]) : std::nullopt;
    if (!ends || *ends <= in_milliseconds(now)) continue;
    const std::chrono::milliseconds at(std::min(*ends, in_milliseconds(EndedSignIn::Time::max())));
    out.push_back({std::string(fields[0]), std::string(fields[2]), EndedSignIn::Time(at)});
  }
  return out;
}

rr::Result<> add_ended_sign_in(const std::string& file, const EndedSignIn& ended, EndedSignIn::Time now) {
  std::error_code none_yet;
  if (const auto size = fs::file_size(file, none_yet); !none_yet && size > much_text) {
    std::string left;
    for (const auto& each : read_ended_sign_ins(file, now)) left += format_line(each);
    if (auto done = rr::write_secret(file, left, true); !done) return done;
  }
  std::error_code exists;  // else open() says what is wrong
  fs::create_directories(fs::path(file).parent_path(), exists);
  const int opened = ::open(file.c_str(), O_WRONLY | O_APPEND | O_CREAT | O_CLOEXEC | O_NOCTTY, 0600);
  const auto line = format_line(ended);
  const bool is_written = opened >= 0 && ::write(opened, line.data(), line.size()) == static_cast<ssize_t>(line.size());
  const std::string why = std::strerror(errno);  // NOLINT(concurrency-mt-unsafe): glibc has one for each thread
  if (opened >= 0) ::close(opened);
  if (!is_written) return rr::make_error(rr::ErrorCode::io_error, rr::quote(file, 200) + ": " + why);
  return {};
}

}  // namespace rrgate
