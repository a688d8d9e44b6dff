#include "server/gateway/front_door.hpp"

#include <algorithm>
#include <array>

#include "server/gateway/gateway.hpp"
#include "server/gateway/http_client.hpp"
#include "server/gateway/native_client.hpp"
#include "server/log/log.hpp"
#include "server/transport/watchdog.hpp"

namespace rrgate {

Protocol detect_protocol(rr::ByteSpan first_bytes) {
  constexpr std::string_view magic = "RRAC";
  constexpr std::uint8_t tls_handshake = 0x16;
  const auto text = rr::as_text(first_bytes.first(std::min<std::size_t>(first_bytes.size(), 4)));
  if (text.empty()) return Protocol::undecided;
  if (text == magic.substr(0, text.size())) return text.size() == 4 ? Protocol::robot_raconteur : Protocol::undecided;
  if (first_bytes[0] == tls_handshake) return Protocol::tls;
  // A method: capital letters, then a space ("GET ") or more letters ("POST", "OPTI").
  const auto space = text.find(' ');
  const auto letters = text.substr(0, space);
  const bool is_method = std::all_of(letters.begin(), letters.end(), [](char c) { return c >= 'A' && c <= 'Z'; });
  if (!is_method || (space != std::string_view::npos && space < 3)) return Protocol::unknown;
  return text.size() == 4 ? Protocol::http : Protocol::undecided;
}

rr::awaitable<void> serve_connection(Gateway& gateway, std::unique_ptr<rr::TcpStream> stream, Admission::Ticket) {
  auto& tcp = *stream;
  Connection connection;
  connection.stop = [&tcp](const rr::EndReason&) { tcp.close(); };
  gateway.add(connection);
  rr::Deadline limit(tcp.executor(), [&tcp] { tcp.close(); });
  limit.arm(gateway.config().limits.header_timeout);

  std::array<std::uint8_t, 4096> first{};
  std::size_t size = 0;
  auto protocol = Protocol::undecided;
  while (protocol == Protocol::undecided) {
    const auto read = co_await tcp.read_some(std::span(first).subspan(size));
    if (read.error || read.is_end()) {
      if (size > 0 || !limit.is_armed())
        log(LogLevel::debug, "connection ended before its first bytes told the protocol", {{"peer", tcp.peer()}});
      co_return;
    }
    size += read.bytes;
    protocol = detect_protocol({first.data(), size});
  }
  limit.disarm();
  tcp.put_back({first.data(), size});

  switch (protocol) {
    case Protocol::robot_raconteur:
      co_await serve_native_client(gateway, connection, std::move(stream));
      break;
    case Protocol::http:
      co_await serve_http_client(gateway, connection, std::move(stream));
      break;
    case Protocol::tls:
      log(LogLevel::info, "connection closed: TLS is not served on this port", {{"peer", tcp.peer()}});
      break;
    default: {
      // The line that native nodes answer with.
      log(LogLevel::info, "connection closed: neither Robot Raconteur nor HTTP",
          {{"peer", tcp.peer()}, {"found", rr::as_text({first.data(), std::min<std::size_t>(size, 16)})}});
      const auto line = rr::as_bytes("HTTP/1.1 404 File Not Found\r\n");
      const std::span<const rr::ByteSpan> slices(&line, 1);
      co_await tcp.write(slices);
      co_await tcp.end(rr::no_reason);
    }
  }
}

}  // namespace rrgate
