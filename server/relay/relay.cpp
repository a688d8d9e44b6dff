#include "server/relay/relay.hpp"

#include <algorithm>
#include <boost/asio/as_tuple.hpp>
#include <boost/asio/co_spawn.hpp>
#include <boost/asio/detached.hpp>
#include <boost/asio/error.hpp>
#include <boost/asio/this_coro.hpp>
#include <boost/asio/use_awaitable.hpp>
#include <chrono>
#include <cstring>
#include <memory>

#include "node/platform/read_buffer.hpp"

namespace rrgate {

namespace asio = boost::asio;

namespace {

/// After the client has ended its side, the answers on their way may still come for so long.
constexpr std::chrono::milliseconds half_closed_time{1000};

/// Time that a direction of opaque bytes saves up while it is idle.
constexpr std::chrono::milliseconds pace_credit{100};

rr::EndReason lost_client(std::uint16_t code, const rr::error_code& error) {
  if (error == asio::error::timed_out) return {1013, "client too slow"};
  return {code, "client lost: " + error.message()};
}

rr::EndReason lost_device(const rr::error_code& error) {
  return {1011, error == asio::error::timed_out ? "device takes no data" : "device lost: " + error.message()};
}

}  // namespace

Relay::Relay(rr::ByteStream& client, rr::ByteStream& device, RelayOptions options, Traffic& traffic,
             MemoryBudget::Charge memory)
    : client_(client),
      device_(device),
      options_(options),
      memory_(std::move(memory)),
      to_device_{client, device, FrameGate(options.max_message_size), false, traffic.to_device},
      to_client_{device, client, FrameGate(options.max_message_size), true, traffic.to_clients},
      half_closed_limit_(client.executor(),
                         [this] {
                           stop({1000, "the client has ended"});
                         }),
      to_device_done_(client.executor(), asio::steady_timer::time_point::max()) {}

rr::awaitable<rr::EndReason> Relay::run() {
  const auto executor = co_await asio::this_coro::executor;
  asio::co_spawn(executor, pump_to_device(), asio::detached);
  co_await pump(to_client_);
  while (!is_to_device_done_) co_await to_device_done_.async_wait(asio::as_tuple(asio::use_awaitable));
  half_closed_limit_.disarm();
  device_.close();
  auto reason = *end_reason_;
  co_await client_.end(reason);
  co_return reason;
}

void Relay::stop(rr::EndReason reason) {
  if (end_reason_) return;
  end_reason_ = std::move(reason);
  device_.close();
  client_.cancel();
  for (auto* direction : {&to_device_, &to_client_})
    if (direction->pace) direction->pace->cancel();
}

rr::awaitable<void> Relay::pump_to_device() {
  co_await pump(to_device_);
  is_to_device_done_ = true;
  to_device_done_.cancel();
}

/// Whatever one direction ends by, the other must hear of it: both use what run() holds.
rr::awaitable<void> Relay::pump(Direction& direction) {
  try {
    co_await pump_all(direction);
  } catch (const std::bad_alloc&) {
    stop({1011, "the gateway has no memory left"});
  }
}

rr::awaitable<void> Relay::pump_all(Direction& direction) {
  rr::ReadBuffer buffer(options_.outbox_bytes);
  std::size_t held = 0;  // bytes of an incomplete message start, at the front; far fewer than there is room for
  while (!end_reason_) {
    const auto room = held == 0 ? buffer.renew() : buffer.room();
    const auto read = co_await direction.from.read_some(room.subspan(held));
    if (read.error || read.is_end()) {
      end_of(direction, read.error);
      break;
    }
    if (end_reason_) break;
    held += read.bytes;
    buffer.note_read(held);
    const auto messages = direction.gate.messages();
    const auto passed = direction.gate.pass(room.first(held));
    direction.flow.messages += direction.gate.messages() - messages;
    if (!passed) {
      stop(broken_rule(direction, passed.error()));
      break;
    }
    if (*passed == 0) continue;
    if (direction.is_from_device && direction.gate.has_seen_start_tls()) {
      to_client_.gate.make_opaque();
      to_device_.gate.make_opaque();
    }
    const rr::ByteSpan slice = room.first(*passed);
    direction.flow.waiting += *passed;
    memory_.hold(memory_.bytes() + *passed);  // bounded for each client: it waits, and nobody is refused
    const auto error = co_await direction.to.write({&slice, 1});
    direction.flow.waiting -= *passed;
    memory_.hold(memory_.bytes() - *passed);
    if (error) {
      stop(direction.is_from_device ? lost_client(1013, error) : lost_device(error));
      break;
    }
    direction.bytes += *passed;
    direction.flow.bytes += *passed;
    held -= *passed;
    if (held > 0) std::memmove(room.data(), room.data() + *passed, held);
    if (direction.gate.is_opaque()) co_await keep_pace(direction, *passed);
  }
}

rr::awaitable<void> Relay::keep_pace(Direction& direction, std::size_t bytes) {
  const auto now = std::chrono::steady_clock::now();
  const std::chrono::nanoseconds cost(
      static_cast<std::int64_t>(1e9 * static_cast<double>(bytes) / static_cast<double>(options_.opaque_rate)));
  auto& pace = direction.pace;
  if (!pace) pace = std::make_unique<asio::steady_timer>(direction.from.executor(), now);
  pace->expires_at(std::max(pace->expiry(), now - pace_credit) + cost);
  // Bytes come in bursts: only what is ahead of the rate by more than that waits.
  if (pace->expiry() > now && !end_reason_) co_await pace->async_wait(asio::as_tuple(asio::use_awaitable));
}

void Relay::end_of(Direction& direction, rr::error_code error) {
  if (direction.is_from_device) {
    stop(end_of_device(error));
  } else if (error) {
    stop(lost_client(1000, error));
  } else if (!end_reason_) {
    device_.finish_sending();
    half_closed_limit_.arm(half_closed_time);
  }
}

rr::EndReason Relay::end_of_device(rr::error_code error) const {
  const auto reason = device_.peer_reason();
  if (error && reason.empty()) return lost_device(error);
  return {1000, "device closed the connection" + (reason.empty() ? std::string() : ": " + reason)};
}

rr::EndReason Relay::broken_rule(const Direction& direction, const rr::Error& error) const {
  const std::uint16_t code = direction.gate.is_too_large() ? 1009 : direction.is_from_device ? 1011 : 1002;
  return {code, (direction.is_from_device ? "from the device: " : "from the client: ") + error.message};
}

}  // namespace rrgate
