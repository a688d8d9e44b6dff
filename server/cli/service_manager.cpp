#include "server/cli/service_manager.hpp"

#include <fcntl.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <time.h>
#include <unistd.h>

#include <cstddef>
#include <cstdlib>
#include <cstring>
#include <string>

#include "core/support/whole_number.hpp"

namespace rrgate {

namespace {

constexpr int first_socket = 3;  // SD_LISTEN_FDS_START
constexpr long most_sockets = 256;

std::optional<long> number_in(const char* variable) {
  const char* text = std::getenv(variable);
  return text ? rr::whole_number<long>(text) : std::nullopt;
}

/// A variable that names a process speaks to that one alone.
bool is_for_us(const char* variable) {
  return number_in(variable).value_or(::getpid()) == ::getpid();
}

}  // namespace

void notify_service_manager(std::string_view text) {
  const char* path = std::getenv("NOTIFY_SOCKET");
  sockaddr_un address{};
  if (!path || (path[0] != '/' && path[0] != '@') || std::strlen(path) >= sizeof(address.sun_path)) return;
  address.sun_family = AF_UNIX;
  const auto size = std::strlen(path);
  std::memcpy(address.sun_path, path, size);
  if (path[0] == '@') address.sun_path[0] = '\0';  // an abstract name
  const int socket = ::socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
  if (socket < 0) return;
  const auto length = static_cast<socklen_t>(offsetof(sockaddr_un, sun_path) + size);
  // Nobody there to hear it is no failure of ours.
  static_cast<void>(
      ::sendto(socket, text.data(), text.size(), MSG_NOSIGNAL, reinterpret_cast<sockaddr*>(&address), length));
  ::close(socket);
}

void notify_reloading() {
  timespec now{};
  ::clock_gettime(CLOCK_MONOTONIC, &now);
  const auto microseconds = static_cast<long long>(now.tv_sec) * 1'000'000 + now.tv_nsec / 1000;
  notify_service_manager("RELOADING=1\nMONOTONIC_USEC=" + std::to_string(microseconds));
}

std::optional<std::chrono::milliseconds> watchdog_period() {
  const auto microseconds = number_in("WATCHDOG_USEC");
  if (!microseconds || *microseconds < 2000 || !is_for_us("WATCHDOG_PID")) return std::nullopt;
  return std::chrono::milliseconds(*microseconds / 2000);  // twice as often as it must be
}

std::vector<int> take_listening_sockets() {
  std::vector<int> out;
  const auto count = number_in("LISTEN_FDS");
  if (count && *count > 0 && *count <= most_sockets && number_in("LISTEN_PID") == ::getpid())
    for (int socket = first_socket; socket < first_socket + *count; ++socket) {
      ::fcntl(socket, F_SETFD, FD_CLOEXEC);
      out.push_back(socket);
    }
  for (const char* variable : {"LISTEN_FDS", "LISTEN_PID", "LISTEN_FDNAMES"}) ::unsetenv(variable);
  return out;
}

}  // namespace rrgate
