#include "server/state/issuer_keys.hpp"

#include <boost/asio/as_tuple.hpp>
#include <boost/asio/co_spawn.hpp>
#include <boost/asio/detached.hpp>
#include <boost/asio/use_awaitable.hpp>

#include "node/driver/backoff.hpp"
#include "node/http/response_reader.hpp"
#include "node/transport/tcp.hpp"
#include "node/transport/tls.hpp"
#include "node/transport/watchdog.hpp"
#include "server/access/issuer_document.hpp"
#include "server/log/log.hpp"

namespace rrgate {

namespace asio = boost::asio;

namespace {

constexpr std::chrono::seconds fetch_patience{5};  // for connecting, and for what follows
constexpr std::chrono::minutes fetch_period{60};
/// Whoever makes up names of keys has the issuer asked no more often.
constexpr std::chrono::seconds shortest_period{30};
constexpr std::size_t largest_document = 256 * 1024;

/// The body of what comes until the connection, or the response, ends.
rr::awaitable<rr::Result<std::string>> read_answer(rr::ByteStream& stream) {
  const auto fail = [](const std::string& why) { return rr::make_error(rr::ErrorCode::connection_error, why); };
  ResponseParser parser;
  const std::function<void()> nobody;
  if (const auto read = co_await read_response(stream, parser, largest_document, nobody); !read) co_return read.error();
  if (parser.get().result_int() != 200) co_return fail("status " + std::to_string(parser.get().result_int()));
  co_return std::move(parser.get().body());
}

}  // namespace

IssuerKeys::IssuerKeys(asio::any_io_executor executor, Access& access)
    : executor_(std::move(executor)),
      access_(access),
      next_(executor_),
      fetched_(executor_, asio::steady_timer::time_point::max()) {}

void IssuerKeys::start() {
  if (is_running_) {
    next_.cancel();
  } else if (access_.state().config.jwt.discovers) {
    is_running_ = true;
    is_fetching_ = true;
    asio::co_spawn(executor_, run(), asio::detached);
  }
}

void IssuerKeys::stop() {
  is_stopping_ = true;
  next_.cancel();
  if (stream_) stream_->close();
}

rr::awaitable<void> IssuerKeys::look_anew() {
  if (!is_running_ || is_stopping_) co_return;
  if (!is_fetching_) {
    const auto now = std::chrono::steady_clock::now();
    if (asked_ != std::chrono::steady_clock::time_point() && now - asked_ < shortest_period) co_return;
    asked_ = now;
    is_fetching_ = true;
    next_.cancel();
  }
  while (is_fetching_) co_await fetched_.async_wait(asio::as_tuple(asio::use_awaitable));
}

rr::awaitable<void> IssuerKeys::run() {
  rr::Backoff retry(std::chrono::seconds(2), std::chrono::minutes(5));
  while (!is_stopping_ && access_.state().config.jwt.discovers) {
    is_fetching_ = true;
    const auto done = co_await fetch();
    is_fetching_ = false;
    fetched_.cancel();
    if (is_stopping_) break;
    if (done)
      retry.reset();
    else
      log(LogLevel::error, "keys of the issuer can't be fetched; those from before stay in use",
          {{"issuer", access_.state().config.jwt.claims.issuer}, {"error", done.error().message}});
    next_.expires_after(done ? std::chrono::milliseconds(fetch_period) : retry.next());
    co_await next_.async_wait(asio::as_tuple(asio::use_awaitable));
  }
  is_running_ = false;
}

rr::awaitable<rr::Result<>> IssuerKeys::fetch() {
  const auto config = access_.state().config.jwt;
  const auto& issuer = config.claims.issuer;
  auto tls = rr::make_web_client_tls({config.ca, {}, {}});
  if (!tls) co_return tls.error();
  auto url = issuer + (issuer.ends_with('/') ? "" : "/") + ".well-known/openid-configuration";
  const auto document = co_await get(std::move(url), *tls);
  if (!document) co_return document.error();
  auto keys_url = read_issuer_document(*document, issuer);
  if (!keys_url) co_return keys_url.error();
  auto keys = co_await get(std::move(*keys_url), *tls);
  if (!keys) co_return keys.error();
  auto taken = access_.take_issuer_keys(issuer, std::move(*keys));
  if (taken) log(LogLevel::info, "keys of the issuer fetched", {{"issuer", issuer}});
  co_return taken;
}

rr::awaitable<rr::Result<std::string>> IssuerKeys::get(std::string url, rr::TlsContextPtr tls) {
  const auto fail = [&url](const std::string& why) {
    return rr::make_error(rr::ErrorCode::connection_error, rr::quote(url, 200) + ": " + why);
  };
  auto wanted = make_https_get(url);
  if (!wanted) co_return fail(wanted.error().message);
  const auto host = wanted->host;
  auto socket = co_await rr::connect_tcp(std::move(wanted->host), wanted->port, fetch_patience);
  if (!socket) co_return fail(socket.error().message);
  if (is_stopping_) co_return fail("the gateway is stopping");
  rr::TlsPeerOptions peer;
  peer.host = host;
  auto tcp = rr::make_tcp_stream(std::move(*socket), fetch_patience);
  rr::TlsStream stream(std::move(tcp), std::move(tls), rr::TlsRole::client, peer);
  stream_ = &stream;
  const struct Gone {
    rr::ByteStream*& stream;
    ~Gone() { stream = nullptr; }
  } gone{stream_};
  rr::Deadline limit(stream.executor(), [&stream] { stream.close(); });
  limit.arm(fetch_patience);
  if (const auto shaken = co_await stream.handshake(fetch_patience); !shaken) co_return fail(shaken.error().message);
  const auto slice = rr::as_bytes(wanted->request);
  const std::span<const rr::ByteSpan> slices(&slice, 1);
  if (const auto error = co_await stream.write(slices)) co_return fail(error.message());
  auto answer = co_await read_answer(stream);
  if (!answer) co_return fail(answer.error().message);
  co_return std::move(*answer);
}

}  // namespace rrgate
