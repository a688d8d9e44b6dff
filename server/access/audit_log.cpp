#include "server/access/audit_log.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstring>
#include <ctime>
#include <utility>

#include "server/json/json.hpp"

namespace rrgate {

namespace {

constexpr std::size_t longest_text = 500;  // of what strangers choose

/// "2030-01-31T12:00:00.123Z".
std::string format_time(std::chrono::system_clock::time_point now) {
  const auto seconds = std::chrono::floor<std::chrono::seconds>(now);
  const auto time = std::chrono::system_clock::to_time_t(seconds);
  std::tm parts{};
  ::gmtime_r(&time, &parts);
  std::array<char, 32> text{};
  const auto size = std::strftime(text.data(), text.size(), "%Y-%m-%dT%H:%M:%S", &parts);
  const auto fraction = std::chrono::duration_cast<std::chrono::milliseconds>(now - seconds).count();
  const auto digits = std::to_string(fraction);
  return std::string(text.data(), size) + "." + std::string(3 - digits.size(), '0') + digits + "Z";
}

}  // namespace

std::string format_audit_line(const AuditEvent& event, std::chrono::system_clock::time_point now) {
  auto out = rr::OrderedJson::object();
  const auto add = [&out](std::string_view key, std::string_view text) {
    if (!text.empty()) rr::add_key(out, key) = std::string(text.substr(0, longest_text));
  };
  add("time", format_time(now));
  add("event", event.event);
  if (event.who) {
    add("user", event.who->name);
    if (!event.who->roles.empty()) rr::add_key(out, "roles") = event.who->roles;
    add("proof", to_string(event.who->proof));
    add("client", event.who->client);
    add("device_user", event.who->device_user);
  }
  if (event.what) {
    add("verb", to_string(event.what->verb));
    add("device", event.what->device);
    add("service", event.what->service);
    add("path", event.what->path);
    add("member", event.what->member);
  }
  add("detail", event.detail);
  return out.dump(-1, ' ', false, rr::OrderedJson::error_handler_t::replace) + "\n";
}

AuditLog::~AuditLog() {
  if (file_ >= 0) ::close(file_);
}

rr::Result<> AuditLog::open(const std::string& path) {
  int opened = -1;
  if (!path.empty()) {
    opened = ::open(path.c_str(), O_WRONLY | O_APPEND | O_CREAT | O_CLOEXEC | O_NOCTTY, 0600);
    if (opened < 0)
      return rr::make_error(rr::ErrorCode::io_error,
                            "audit file " + rr::quote(path, 200) + ": " + std::strerror(errno));
  }
  const std::lock_guard lock(mutex_);
  const int old = std::exchange(file_, opened);
  path_ = path;
  begins_line_ = true;
  if (old >= 0) ::close(old);
  return {};
}

rr::Result<> AuditLog::reopen() {
  std::string path;
  {
    const std::lock_guard lock(mutex_);
    path = path_;
  }
  return open(path);
}

bool AuditLog::write(const AuditEvent& event) {
  const std::lock_guard lock(mutex_);
  if (file_ < 0) return true;
  auto line = format_audit_line(event, std::chrono::system_clock::now());
  if (!begins_line_) line.insert(0, "\n");
  const auto written = ::write(file_, line.data(), line.size());
  const bool is_whole = written == static_cast<ssize_t>(line.size());
  if (written > 0) begins_line_ = is_whole;
  if (!is_whole) ++lost_;
  return is_whole;
}

std::uint64_t AuditLog::lost_lines() const {
  const std::lock_guard lock(mutex_);
  return lost_;
}

}  // namespace rrgate
