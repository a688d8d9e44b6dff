#include "server/transport/dial.hpp"

#include "server/transport/tcp.hpp"

namespace rrgate {

namespace {

using Dialed = rr::Result<std::unique_ptr<ByteStream>>;

awaitable<Dialed> dial_tcp(rr::ConnectionUrl url, DialOptions options, Watchdog& watchdog) {
  auto socket = co_await connect_tcp(url.host, url.port, options.timeout);
  if (!socket) co_return socket.error();
  std::unique_ptr<ByteStream> stream = std::make_unique<TcpStream>(std::move(*socket), watchdog, options.send_stall);
  co_return stream;
}

struct Dialer {
  std::string_view scheme;
  awaitable<Dialed> (*dial)(rr::ConnectionUrl, DialOptions, Watchdog&);
};

/// A transport adds its line here.
constexpr Dialer dialers[] = {
    {"rr+tcp", dial_tcp},
};

const Dialer* find_dialer(std::string_view scheme) {
  for (const auto& dialer : dialers)
    if (dialer.scheme == scheme) return &dialer;
  return nullptr;
}

}  // namespace

bool can_dial(std::string_view scheme) {
  return find_dialer(scheme) != nullptr;
}

std::string dialable_schemes() {
  std::string out;
  for (const auto& dialer : dialers) out += (out.empty() ? "" : ", ") + std::string(dialer.scheme);
  return out;
}

awaitable<Dialed> dial(rr::ConnectionUrl url, DialOptions options, Watchdog& watchdog) {
  const auto* dialer = find_dialer(url.scheme);
  if (!dialer)
    co_return rr::make_error(rr::ErrorCode::connection_error,
                             "scheme " + rr::quoted(url.scheme) + " can't be dialed; available: " + dialable_schemes());
  co_return co_await dialer->dial(std::move(url), options, watchdog);
}

}  // namespace rrgate
