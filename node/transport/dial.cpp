#include "node/transport/dial.hpp"

#include "node/tls/certificate_files.hpp"
#include "node/transport/hardware.hpp"
#include "node/transport/intra.hpp"
#include "node/transport/local.hpp"
#include "node/transport/race.hpp"
#include "node/transport/start_tls.hpp"
#include "node/transport/tcp.hpp"
#include "node/transport/tls.hpp"
#include "node/transport/watchdog.hpp"

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
  auto stream = make_tcp_stream(std::move(*socket), options.send_stall);
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

/// What the next step may take of a time that all steps have together.
std::chrono::milliseconds left_of(std::chrono::milliseconds timeout, std::chrono::steady_clock::time_point begin) {
  const auto passed = std::chrono::duration_cast<std::chrono::milliseconds>(std::chrono::steady_clock::now() - begin);
  return std::max(timeout - passed, std::chrono::milliseconds(1));
}

/// HTTPS below the WebSocket.
awaitable<Dialed> dial_https_websocket(ConnectionUrl url, DialOptions options) {
  if (!options.web_tls) {
    auto context = make_web_client_tls({});
    if (!context) co_return context.error();
    options.web_tls = *context;
  }
  const auto begin = std::chrono::steady_clock::now();
  auto stream = co_await reach(url, options);
  if (!stream) co_return stream;
  TlsPeerOptions server;
  server.host = url.host;
  auto tls = std::make_unique<TlsStream>(std::move(*stream), options.web_tls, TlsRole::client, server);
  if (auto done = co_await tls->handshake(left_of(options.timeout, begin)); !done) co_return done.error();
  const Limit limit(*tls, left_of(options.timeout, begin));
  auto socket = co_await connect_websocket(std::move(tls), std::move(url), std::move(options.headers));
  if (!socket) co_return limit.explain(socket.error());
  co_return socket;
}

using Dial = awaitable<Dialed> (*)(ConnectionUrl, DialOptions);

/// TLS between the nodes, inside of what `below` reaches.
template <Dial below>
awaitable<Dialed> dial_secure(ConnectionUrl url, DialOptions options) {
  if (!options.tls) {
    NodeTlsOptions anonymous;
    anonymous.trust = default_trust();
    auto context = make_node_tls(anonymous);
    if (!context) co_return context.error();
    options.tls = *context;
  }
  const auto begin = std::chrono::steady_clock::now();
  NodeIdentity target{url.node_id.value_or(NodeId{}), url.node_name};
  auto stream = co_await below(std::move(url), options);
  if (!stream) co_return stream;
  const auto left = left_of(options.timeout, begin);
  co_return co_await start_tls_client(std::move(*stream), std::move(target), std::move(options.tls), left);
}

struct Dialer {
  std::string_view scheme;
  Dial dial;
};

/// A transport adds its line here.
constexpr Dialer dialers[] = {
    {"rr+tcp", dial_tcp},
    {"rrs+tcp", dial_secure<dial_tcp>},
    {"rr+ws", dial_websocket},
    {"rr+local", dial_local},
    {"rr+intra", dial_intra},
    {"rrs+ws", dial_secure<dial_websocket>},
    {"rr+wss", dial_https_websocket},
    {"rrs+wss", dial_secure<dial_https_websocket>},
    {"rr+usb", dial_device},
    {"rr+pci", dial_device},
};

const Dialer* find_dialer(std::string_view scheme) {
  for (const auto& dialer : dialers)
    if (dialer.scheme == scheme) return &dialer;
  return nullptr;
}

}  // namespace

Heartbeat heartbeat_of(std::string_view scheme) {
  using std::chrono::milliseconds;
  if (scheme == "rr+intra") return {std::chrono::hours(24 * 365), std::chrono::hours(24)};  // none: it can't be cut
  if (scheme == "rr+local") return {milliseconds(30'000), milliseconds(600'000)};
  const auto* known = find_url_scheme(scheme);
  if (known && !known->needs_host) return {milliseconds(5'000), milliseconds(15'000)};
  return {};
}

bool can_dial(std::string_view scheme) {
  return find_dialer(scheme) != nullptr;
}

std::string dialable_schemes() {
  std::string out;
  for (const auto& dialer : dialers) out += (out.empty() ? "" : ", ") + std::string(dialer.scheme);
  return out;
}

awaitable<Dialed> dial(ConnectionUrl url, DialOptions options) {
  if (options.reach) co_return co_await options.reach();
  const auto* dialer = find_dialer(url.scheme);
  if (!dialer)
    co_return make_error(ErrorCode::connection_error,
                         "scheme " + rr::quote(url.scheme) + " can't be dialed; available: " + dialable_schemes());
  co_return co_await dialer->dial(std::move(url), options);
}

awaitable<Dialed> dial_any(std::vector<ConnectionUrl> urls, DialOptions options) {
  std::vector<Runner<std::unique_ptr<ByteStream>>> runners;
  for (auto& url : urls) {
    Runner<std::unique_ptr<ByteStream>> runner;
    runner.name = format_url(url);
    runner.run = [url = std::move(url), options] { return dial(url, options); };
    runners.push_back(std::move(runner));
  }
  const auto nothing = make_error(ErrorCode::connection_error, "connect: no URL that can be dialed");
  co_return co_await race(std::move(runners), candidate_stagger, nothing);
}

}  // namespace rr
