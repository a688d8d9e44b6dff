#include "server/transport/dial.hpp"

#include "server/transport/tcp.hpp"

namespace rr {

namespace {

using Dialed = Result<std::unique_ptr<ByteStream>>;

awaitable<Dialed> dial_tcp(ConnectionUrl url, DialOptions options) {
  auto socket = co_await connect_tcp(url.host, url.port, options.timeout);
  if (!socket) co_return socket.error();
  std::unique_ptr<ByteStream> stream = std::make_unique<TcpStream>(std::move(*socket), options.send_stall);
  co_return stream;
}

struct Dialer {
  std::string_view scheme;
  awaitable<Dialed> (*dial)(ConnectionUrl, DialOptions);
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

awaitable<Dialed> dial(ConnectionUrl url, DialOptions options) {
  const auto* dialer = find_dialer(url.scheme);
  if (!dialer)
    co_return make_error(ErrorCode::connection_error,
                         "scheme " + quoted(url.scheme) + " can't be dialed; available: " + dialable_schemes());
  co_return co_await dialer->dial(std::move(url), options);
}

}  // namespace rr
