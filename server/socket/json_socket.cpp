#include "server/socket/json_socket.hpp"

#include <boost/asio/as_tuple.hpp>
#include <boost/asio/co_spawn.hpp>
#include <boost/asio/detached.hpp>
#include <boost/asio/use_awaitable.hpp>

#include "node/transport/websocket_messages.hpp"
#include "server/http/endpoints/call_log.hpp"
#include "server/socket/json_operations.hpp"

namespace rrgate {

namespace asio = boost::asio;

namespace {

constexpr std::string_view objects_prefix = "/api/v1/devices/";
/// A socket without news for so long is pinged; who is silent for several of these is gone.
constexpr std::chrono::seconds ping_period{15};
constexpr auto silence_limit = ping_period * 3;
/// Of a message that comes in parts: so little is not worth an entry in the account of memory.
constexpr std::size_t uncounted_bytes = 16 * 1024;

/// One socket: reads in one coroutine, writes in another.
class JsonSocket : public std::enable_shared_from_this<JsonSocket> {
 public:
  JsonSocket(GatewayState& gateway, std::unique_ptr<rr::ByteStream> stream, const JsonSocketPlace& place)
      : stream_(std::move(stream)),
        memory_(gateway.memory().charge(place.from.network)),
        messages_(*stream_, gateway.config().limits.body_bytes,
                  [this](std::size_t bytes) { return memory_.resize(bytes < uncounted_bytes ? 0 : bytes); }),
        outbox_(std::make_shared<JsonOutbox>(stream_->executor(), memory_.sibling())),
        operations_(std::make_shared<JsonOperations>(gateway, place, outbox_)),
        written_(stream_->executor(), asio::steady_timer::time_point::max()) {}

  /// Ends what the client has no right to any more.
  void review() { operations_->review(); }
  /// Ends it soon.
  void stop(rr::EndReason reason) {
    if (std::exchange(is_over_, true)) return;
    reason_ = std::move(reason);
    operations_->stop();
    outbox_->news().cancel();
    messages_.cancel();
  }

  rr::awaitable<std::string> run() {
    asio::co_spawn(stream_->executor(), write_all(shared_from_this()), asio::detached);
    while (!is_over_) {
      const auto message = co_await messages_.read();
      if (!message) break;
      co_await operations_->take(*message);
    }
    stop({1000, "the client has ended it"});
    outbox_->close();
    while (!is_written_) co_await written_.async_wait(asio::as_tuple(asio::use_awaitable));
    co_await messages_.end(reason_);
    co_return reason_.text;
  }

 private:
  static rr::awaitable<void> write_all(std::shared_ptr<JsonSocket> self) {
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
      if (self->outbox_->is_empty() && self->outbox_->has_overflown())
        self->stop({1008, "too slow: messages were lost"});
    }
    self->is_written_ = true;
    self->written_.cancel();
  }

  std::unique_ptr<rr::ByteStream> stream_;
  MemoryBudget::Charge memory_;  ///< of the message that comes
  rr::WebSocketMessages messages_;
  std::shared_ptr<JsonOutbox> outbox_;
  std::shared_ptr<JsonOperations> operations_;
  rr::EndReason reason_;
  bool is_over_ = false;
  bool is_written_ = false;
  asio::steady_timer written_;  ///< cancelled when the writing coroutine has ended
};

}  // namespace

bool is_json_socket(const Request& request) {
  return request.path().substr(0, objects_prefix.size()) == objects_prefix;
}

rr::Result<std::shared_ptr<JsonSocketPlace>> find_json_socket(GatewayState& gateway, const Request& request) {
  auto segments = split_path(request.path().substr(objects_prefix.size()));
  if (!segments) return segments.error();
  if (segments->size() < 2)
    return rr::make_error(rr::ErrorCode::object_not_found, "expected /api/v1/devices/DEVICE/SERVICE");
  // What is done to which member is judged when it is asked for.
  const AccessRequest wanted{.device = segments->front(), .service = (*segments)[1]};
  if (const auto allowed = gateway.access().check(request.identity, wanted); !allowed) return allowed.error();
  auto* device = gateway.devices().find(segments->front());
  if (!device)
    return rr::make_error(rr::ErrorCode::node_not_found,
                          "no device " + rr::quote(segments->front()) + "; /api/v1/devices lists them");
  auto place = std::make_shared<JsonSocketPlace>();
  place->device = device->shared_from_this();
  place->standing = std::make_shared<Standing>(gateway.access(), request.identity);
  place->from = request.origin();
  place->key = session_key(gateway, request, (*segments)[1]);
  place->segments.assign(segments->begin() + 2, segments->end());
  place->form = json_form(request);
  place->trace = trace_id_of(request.header("traceparent"));
  return place;
}

rr::awaitable<void> serve_json_socket(GatewayState& gateway, Connection& connection,
                                      std::unique_ptr<rr::ByteStream> stream, std::shared_ptr<JsonSocketPlace> place) {
  const auto socket = std::make_shared<JsonSocket>(gateway, std::move(stream), *place);
  const auto device = place->device->config().name;
  connection.device = place->device.get();
  connection.stop = [socket](rr::EndReason reason) { socket->stop(std::move(reason)); };
  connection.is_good = [standing = place->standing, socket] {
    socket->review();
    return standing->is_good();
  };
  log(LogLevel::info, "client connected", {{"device", device}, {"peer", connection.client}, {"as", "json"}});

  const auto reason = co_await socket->run();

  connection.device = nullptr;
  connection.is_good = nullptr;
  connection.stop = [](const rr::EndReason&) {};
  log(LogLevel::info, "client disconnected", {{"device", device}, {"peer", connection.client}, {"reason", reason}});
}

}  // namespace rrgate
