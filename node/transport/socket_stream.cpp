#include "node/transport/socket_stream.hpp"

#include <array>

namespace rr {

namespace {

/// How long end() waits for the peer to take the last bytes, and how much it reads meanwhile.
constexpr std::chrono::milliseconds linger_time{1000};
constexpr std::size_t linger_bytes = 1024 * 1024;

}  // namespace

SocketStream::SocketStream(Socket socket, std::string peer, std::chrono::milliseconds send_stall)
    : DescriptorStream(std::move(socket), std::move(peer), send_stall),
      linger_(descriptor().get_executor(), [this] { cancel(); }) {}

void SocketStream::finish_sending() {
  error_code ignored;
  descriptor().shutdown(Socket::shutdown_send, ignored);
}

awaitable<void> SocketStream::end(const EndReason&) {
  // Closing with unread input resets the connection, and a reset may overtake the last bytes sent: read on for a while.
  finish_sending();
  linger_.arm(linger_time);
  thread_local std::array<std::uint8_t, 4096> scrap;  // for all: nobody looks at it
  for (std::size_t total = 0; total < linger_bytes && linger_.is_armed();) {
    const auto read = co_await read_some(scrap);
    if (read.error || read.is_end()) break;
    total += read.bytes;
  }
  linger_.disarm();
  close();
}

}  // namespace rr
