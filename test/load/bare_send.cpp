// bare_send: the yardstick of fan-out: one thread that does nothing but send() the same bytes to many sockets, again
// and again, which a process of its own reads. Prints as JSON what a send costs.
//   bare_send SOCKETS BYTES TIMES_A_SECOND SECONDS
#include <arpa/inet.h>
#include <netinet/tcp.h>
#include <sys/epoll.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <thread>
#include <vector>

namespace {

int check(int result, const char* what) {
  if (result >= 0) return result;
  std::perror(what);
  std::_Exit(1);
}

/// Reads and forgets, until its parent ends.
[[noreturn]] void read_all(const sockaddr_in& address, std::size_t sockets) {
  ::prctl(PR_SET_PDEATHSIG, SIGKILL);
  const int poll = check(::epoll_create1(0), "epoll");
  for (std::size_t i = 0; i < sockets; ++i) {
    epoll_event event{};
    event.events = EPOLLIN;
    event.data.fd = check(::socket(AF_INET, SOCK_STREAM, 0), "socket");
    check(::connect(event.data.fd, reinterpret_cast<const sockaddr*>(&address), sizeof address), "connect");
    check(::epoll_ctl(poll, EPOLL_CTL_ADD, event.data.fd, &event), "epoll_ctl");
  }
  std::array<epoll_event, 64> events{};
  std::array<char, 65536> buffer{};
  for (;;) {
    const int count = check(::epoll_wait(poll, events.data(), static_cast<int>(events.size()), -1), "epoll_wait");
    for (int i = 0; i < count; ++i)
      check(static_cast<int>(::recv(events[static_cast<std::size_t>(i)].data.fd, buffer.data(), buffer.size(), 0)),
            "recv");
  }
}

double cpu_seconds() {
  rusage usage{};
  ::getrusage(RUSAGE_SELF, &usage);
  const auto seconds = [](const timeval& time) {
    return static_cast<double>(time.tv_sec) + static_cast<double>(time.tv_usec) / 1e6;
  };
  return seconds(usage.ru_utime) + seconds(usage.ru_stime);
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 5) {
    std::fprintf(stderr, "usage: bare_send SOCKETS BYTES TIMES_A_SECOND SECONDS\n");
    return 2;
  }
  const auto count = static_cast<std::size_t>(std::atoi(argv[1]));
  const std::vector<char> bytes(static_cast<std::size_t>(std::atoi(argv[2])));
  const auto period = std::chrono::nanoseconds(1'000'000'000 / std::atoi(argv[3]));
  const auto rounds = std::atoi(argv[3]) * std::atoi(argv[4]);

  const int listener = check(::socket(AF_INET, SOCK_STREAM, 0), "socket");
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = ::htonl(INADDR_LOOPBACK);
  socklen_t size = sizeof address;
  check(::bind(listener, reinterpret_cast<sockaddr*>(&address), size), "bind");
  check(::listen(listener, static_cast<int>(count)), "listen");
  check(::getsockname(listener, reinterpret_cast<sockaddr*>(&address), &size), "getsockname");
  if (check(::fork(), "fork") == 0) read_all(address, count);

  std::vector<int> sockets(count);
  for (auto& socket : sockets) {
    socket = check(::accept4(listener, nullptr, nullptr, SOCK_NONBLOCK), "accept");
    const int on = 1;
    check(::setsockopt(socket, IPPROTO_TCP, TCP_NODELAY, &on, sizeof on), "setsockopt");
  }
  const double before = cpu_seconds();
  auto next = std::chrono::steady_clock::now();
  for (int round = 0; round < rounds; ++round) {
    std::this_thread::sleep_until(next += period);
    for (const int socket : sockets) check(static_cast<int>(::send(socket, bytes.data(), bytes.size(), 0)), "send");
  }
  const double cpu = cpu_seconds() - before;
  std::printf("{\"sends\": %zu, \"cpu_seconds\": %.6f}\n", count * static_cast<std::size_t>(rounds), cpu);
}
