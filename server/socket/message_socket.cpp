#include "server/socket/message_socket.hpp"

#include <boost/asio/as_tuple.hpp>
#include <boost/asio/co_spawn.hpp>
#include <boost/asio/detached.hpp>
#include <boost/asio/use_awaitable.hpp>

namespace rrgate {

namespace asio = boost::asio;

namespace {

/// A socket without news for so long is pinged; who is silent for several of these is gone.
constexpr std::chrono::seconds ping_period{15};
constexpr auto silence_limit = ping_period * 3;
/// Of a message that comes in parts: so little is not worth an entry in the account of memory.
constexpr std::size_t uncounted_bytes = 16 * 1024;
constexpr const char* socket_too_slow = R"({"error":{"name":"RobotRaconteur.OutOfSystemResource",)"
                                        R"("message":"too slow: messages were lost, so the connection ends"}})";

}  // namespace

MessageSocket::MessageSocket(std::unique_ptr<rr::ByteStream> stream, std::size_t max_message_bytes,
                             MemoryBudget::Charge memory)
    : stream_(std::move(stream)),
      memory_(std::move(memory)),
      messages_(*stream_, max_message_bytes,
                [this](std::size_t bytes) { return memory_.resize(bytes < uncounted_bytes ? 0 : bytes); }),
      outbox_(std::make_shared<Outbox>(stream_->executor(), memory_.sibling(), socket_too_slow)),
      written_(stream_->executor(), asio::steady_timer::time_point::max()) {}

void MessageSocket::stop(rr::EndReason reason) {
  if (std::exchange(is_over_, true)) return;
  reason_ = std::move(reason);
  if (const auto stopped = std::exchange(stopped_, nullptr)) stopped();
  outbox_->news().cancel();
  messages_.cancel();
}

rr::awaitable<std::string> MessageSocket::run(std::function<rr::awaitable<void>(const std::string&)> take,
                                              std::function<void()> stopped) {
  const auto self = shared_from_this();
  stopped_ = std::move(stopped);
  asio::co_spawn(stream_->executor(), write_all(self), asio::detached);
  while (!is_over_) {
    const auto message = co_await messages_.read();
    if (!message) break;
    co_await take(*message);
  }
  stop({1000, "the client has ended it"});
  outbox_->close();
  while (!is_written_) co_await written_.async_wait(asio::as_tuple(asio::use_awaitable));
  co_await messages_.end(reason_);
  co_return reason_.text;
}

rr::awaitable<void> MessageSocket::write_all(std::shared_ptr<MessageSocket> self) {
  while (!self->is_over_) {
    rr::error_code failed;
    if (self->outbox_->is_empty()) {
      auto& news = self->outbox_->news();
      news.expires_after(ping_period);
      const auto [cancelled] = co_await news.async_wait(asio::as_tuple(asio::use_awaitable));
      if (cancelled) continue;
      if (std::chrono::steady_clock::now() - self->messages_.last_heard() > silence_limit)
        self->stop({1001, "no answer to pings"});
      else
        failed = co_await self->messages_.ping();
    } else {
      const auto batch = self->outbox_->take();
      failed = co_await self->messages_.write(batch);
      self->outbox_->note_sent();
    }
    if (failed) self->stop({1001, "the client has gone, or takes nothing"});
    if (self->outbox_->is_empty() && self->outbox_->has_overflown()) self->stop({1008, "too slow: messages were lost"});
  }
  self->is_written_ = true;
  self->written_.cancel();
}

}  // namespace rrgate
