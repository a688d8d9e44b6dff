#include "server/state/issuer_keys.hpp"

#include <boost/asio/as_tuple.hpp>
#include <boost/asio/co_spawn.hpp>
#include <boost/asio/detached.hpp>
#include <boost/asio/use_awaitable.hpp>

#include "core/session/url.hpp"
#include "node/driver/backoff.hpp"
#include "node/http/response_reader.hpp"
#include "node/transport/tcp.hpp"
#include "node/transport/tls.hpp"
#include "node/transport/watchdog.hpp"
#include "server/json/json.hpp"
#include "server/log/log.hpp"

namespace rrgate {

namespace asio = boost::asio;

namespace {

constexpr std::chrono::seconds fetch_patience{5};  // for connecting, and for what follows
constexpr std::chrono::minutes fetch_period{60};
/// Whoever makes up names of keys has the issuer asked no more often.
constexpr std::chrono::seconds shortest_period{30};
constexpr std::size_t largest_document = 256 * 1024;
constexpr std::string_view https = "https://";

rr::Result<std::string> text_at(std::string_view document, const char* key) {
  const auto json = rr::read_json(document);
  const auto found = json && json->is_object() ? json->find(key) : rr::Json::const_iterator();
  if (!json || !json->is_object() || found == json->end() || !found->is_string())
    return rr::make_error(rr::ErrorCode::connection_error,
                          "the issuer's document: expected an object with a text " + std::string(key));
  return found->get<std::string>();
}

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
  const auto name = text_at(*document, "issuer");
  if (!name) co_return name.error();
  if (*name != issuer)
    co_return rr::make_error(rr::ErrorCode::connection_error, "the document is of the issuer " + rr::quote(*name, 200));
  auto keys_url = text_at(*document, "jwks_uri");
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
  if (!url.starts_with(https)) co_return fail("expected https://");
  // The same form, with the same port where none is named.
  const auto parts = rr::parse_url("rr+wss://" + url.substr(https.size()), rr::ServiceInUrl::optional);
  if (!parts) co_return fail(parts.error().message);
  std::string host = parts->host;
  auto socket = co_await rr::connect_tcp(std::move(host), parts->port, fetch_patience);
  if (!socket) co_return fail(socket.error().message);
  if (is_stopping_) co_return fail("the gateway is stopping");
  rr::TlsPeerOptions peer;
  peer.host = parts->host;
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
  const auto authority = url.substr(https.size(), url.find_first_of("/?", https.size()) - https.size());
  const auto request = "GET " + (parts->path.empty() ? "/" : parts->path) +
                       (parts->query.empty() ? "" : "?" + parts->query) + " HTTP/1.1\r\nHost: " + authority +
                       "\r\nAccept: application/json\r\nUser-Agent: rrgate\r\nConnection: close\r\n\r\n";
  const auto slice = rr::as_bytes(request);
  const std::span<const rr::ByteSpan> slices(&slice, 1);
  if (const auto error = co_await stream.write(slices)) co_return fail(error.message());
  auto answer = co_await read_answer(stream);
  if (!answer) co_return fail(answer.error().message);
  co_return std::move(*answer);
}

}  // namespace rrgate
