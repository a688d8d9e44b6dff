// How a client's connection begins: its URLs, the stream to one of them, and what gives it up. Layer: node/client.
#include <boost/asio/bind_cancellation_slot.hpp>
#include <boost/asio/co_spawn.hpp>
#include <boost/asio/post.hpp>

#include "core/session/url.hpp"
#include "core/support/random.hpp"
#include "node/client/client_connection.hpp"
#include "node/driver/post_cancel.hpp"

namespace rr {

namespace asio = boost::asio;

namespace {

/// Whichever URL is taken, a peer that is gone is noticed as soon as it should be.
Heartbeat quickest_heartbeat(const std::vector<ConnectionUrl>& urls) {
  auto out = heartbeat_of(urls.front().scheme);
  for (const auto& url : urls)
    if (const auto other = heartbeat_of(url.scheme); other.period < out.period) out = other;
  return out;
}

/// Throws   boost::system::system_error: it was cancelled.
awaitable<void> dial_and_start(std::vector<ConnectionUrl> urls, ConnectOptions options,
                               std::shared_ptr<ClientOpening> opening, ClientConnection::Opened done) {
  options.dial.timeout = bounded(options.connect_timeout);
  const auto deadline = std::chrono::steady_clock::now() + options.dial.timeout;
  const auto heartbeat = options.heartbeat.value_or(quickest_heartbeat(urls));
  options.connection.heartbeat_period = heartbeat.period;
  options.connection.receive_timeout = heartbeat.timeout;
  auto stream = co_await dial_any(std::move(urls), std::move(options.dial));
  if (opening->is_over()) co_return;
  if (!stream) co_return done(stream.error());
  const auto left = std::chrono::duration_cast<std::chrono::milliseconds>(deadline - std::chrono::steady_clock::now());
  options.connect_timeout = std::max(left, std::chrono::milliseconds(1));
  options.connection.known_peer = (*stream)->verified_peer();
  const auto connection = std::make_shared<ClientConnection>(std::move(*stream), std::move(options), std::move(done));
  opening->begin_session(connection);
  connection->start();
}

}  // namespace

void ClientOpening::cancel() {
  if (std::exchange(is_over_, true)) return;
  post_cancel(executor_, dialing_);
  if (const auto connection = connection_.lock())
    connection->close(make_error(ErrorCode::operation_cancelled, "connecting was given up"));
}

void ClientConnection::open(std::unique_ptr<ByteStream> stream, ConnectOptions options, Opened done) {
  options.connection.known_peer = stream->verified_peer();
  if (options.connection.self.id.is_any()) options.connection.self.id = random_node_id();
  std::make_shared<ClientConnection>(std::move(stream), std::move(options), std::move(done))->start();
}

std::shared_ptr<ClientOpening> ClientConnection::open(asio::io_context& io, std::string_view url,
                                                      ConnectOptions options, Opened done) {
  const auto opening = std::make_shared<ClientOpening>(io.get_executor());
  auto tell = [opening, done = std::move(done)](Result<std::shared_ptr<ClientConnection>> opened) {
    if (!std::exchange(opening->is_over_, true)) done(std::move(opened));
  };
  const auto refuse = [&](ErrorCode code, std::string why) {
    asio::post(io, [tell, error = make_error(code, std::move(why))] { tell(error); });
    return opening;
  };
  std::vector<std::string> texts{std::string(url)};
  texts.insert(texts.end(), options.other_urls.begin(), options.other_urls.end());
  std::vector<ConnectionUrl> urls;
  for (const auto& text : texts) {
    const auto parsed = parse_url(text);
    if (!parsed) return refuse(parsed.error().code, parsed.error().message);
    if (!can_dial(parsed->scheme))
      return refuse(ErrorCode::connection_error, "connect to " + quote(text) + ": scheme '" + parsed->scheme +
                                                     "' is not available here, expected " + dialable_schemes());
    urls.push_back(*parsed);
  }
  options.service = urls.front().service;
  options.connection.target = {urls.front().node_id.value_or(NodeId{}), urls.front().node_name};
  if (options.connection.self.id.is_any()) options.connection.self.id = random_node_id();
  auto work = dial_and_start(std::move(urls), std::move(options), opening, std::move(tell));
  // Posted: `done` is not called before this returns.
  asio::post(io, [&io, opening, work = std::move(work)]() mutable {
    if (opening->is_over_) return;
    const auto keep = [opening](std::exception_ptr) {};  // the coroutine uses the slot until this is called
    asio::co_spawn(io, std::move(work), asio::bind_cancellation_slot(opening->dialing_->slot(), keep));
  });
  return opening;
}

}  // namespace rr
