#include "server/transport/dial.hpp"

#include "server/transport/hardware.hpp"
#include "server/transport/tcp.hpp"
#include "server/transport/watchdog.hpp"

namespace rr {

namespace {

using Dialed = Result<std::unique_ptr<ByteStream>>;

/// Closes a stream whose other end takes too long to agree to something.
class Limit {
 public:
  Limit(ByteStream& stream, std::chrono::milliseconds timeout)
      : timeout_(timeout), deadline_(stream.executor(), [this, &stream] {
          is_over_ = true;
          stream.close();
        }) {
    deadline_.arm(timeout);
  }

  /// The true reason of a failure that may come from the closing.
  Error explain(Error failure) const {
    if (is_over_) failure.message += ": no answer within " + std::to_string(timeout_.count()) + " ms";
    return failure;
  }

 private:
  std::chrono::milliseconds timeout_;
  bool is_over_ = false;
  Deadline deadline_;
};

/// The TCP connection below all schemes that have a host.
awaitable<Dialed> reach(ConnectionUrl url, DialOptions options) {
  const bool has_proxy = !options.proxy.host.empty();
  const HostPort next = has_proxy ? options.proxy : HostPort{url.host, url.port};
  auto socket = co_await connect_tcp(next.host, next.port, options.timeout);
  if (!socket) co_return socket.error();
  std::unique_ptr<ByteStream> stream = std::make_unique<TcpStream>(std::move(*socket), options.send_stall);
  if (has_proxy) {
    const Limit limit(*stream, options.timeout);
    HostPort target{url.host, url.port};
    const auto opened = co_await connect_through_proxy(*stream, std::move(target));
    if (!opened) co_return limit.explain(opened.error());
  }
  co_return stream;
}

awaitable<Dialed> dial_tcp(ConnectionUrl url, DialOptions options) {
  co_return co_await reach(std::move(url), std::move(options));
}

awaitable<Dialed> dial_websocket(ConnectionUrl url, DialOptions options) {
  auto stream = co_await reach(url, options);
  if (!stream) co_return stream;
  const Limit limit(**stream, options.timeout);
  auto socket = co_await connect_websocket(std::move(*stream), std::move(url), std::move(options.headers));
  if (!socket) co_return limit.explain(socket.error());
  co_return socket;
}

awaitable<Dialed> dial_device(ConnectionUrl url, DialOptions options) {
  return dial_hardware(std::move(url), std::move(options));
}

struct Dialer {
  std::string_view scheme;
  awaitable<Dialed> (*dial)(ConnectionUrl, DialOptions);
};

/// A transport adds its line here.
constexpr Dialer dialers[] = {
    {"rr+tcp", dial_tcp},
    {"rr+ws", dial_websocket},
    {"rr+usb", dial_device},
    {"rr+pci", dial_device},
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
