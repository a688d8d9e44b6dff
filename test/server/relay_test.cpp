// What the relay does that the gateway's own tests can't wait for: streams in memory.
#include "server/relay/relay.hpp"

#include <boost/asio/co_spawn.hpp>
#include <boost/asio/detached.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/asio/use_awaitable.hpp>
#include <catch2/catch.hpp>

#include "core/session/start_tls.hpp"
#include "node/transport/websocket.hpp"
#include "test/node/transport/memory_stream.hpp"

using namespace rrgate;
using std::chrono::milliseconds;

namespace {

/// As a device does: what follows its consent waits until the client has that.
rr::awaitable<void> send_all(rr::ByteStream& stream, rr::Bytes consent, rr::Bytes rest, const std::size_t& received) {
  const rr::ByteSpan first(consent);
  const std::span<const rr::ByteSpan> consent_slices(&first, 1);
  co_await stream.write(consent_slices);
  boost::asio::steady_timer pause(stream.executor());
  while (received < consent.size()) {
    pause.expires_after(milliseconds(1));
    co_await pause.async_wait(boost::asio::use_awaitable);
  }
  const rr::ByteSpan second(rest);
  const std::span<const rr::ByteSpan> rest_slices(&second, 1);
  co_await stream.write(rest_slices);
  stream.finish_sending();
}

rr::awaitable<void> receive_all(rr::ByteStream& stream, std::size_t& received) {
  rr::Bytes buffer(65536);
  for (;;) {
    const auto read = co_await stream.read_some(buffer);
    if (read.error || read.is_end()) break;
    received += read.bytes;
  }
}

/// A device that agrees to TLS, then sends `bytes` that are no message, through a relay of `rate`.
struct OpaqueRun {
  explicit OpaqueRun(std::size_t bytes, std::size_t rate, milliseconds stop_after = milliseconds(60'000)) {
    boost::asio::io_context io(1);
    rr::test::MemoryStreams client(io.get_executor());
    rr::test::MemoryStreams device(io.get_executor());
    Traffic traffic;
    MemoryBudget budget(1'000'000'000);
    Relay relay(*client.server, *device.client, {5'000'000, 65'536, rate}, traffic, budget.charge("client"));
    const rr::NodeIdentity self{rr::NodeId{{1}}, "device"};
    auto out = rr::answer_first_request(rr::make_start_tls({}, true), self, true).value().reply;
    sent = out.size() + bytes;
    const auto begin = std::chrono::steady_clock::now();
    boost::asio::co_spawn(io, send_all(*device.server, std::move(out), rr::Bytes(bytes), received),
                          boost::asio::detached);
    boost::asio::co_spawn(io, receive_all(*client.client, received), boost::asio::detached);
    boost::asio::co_spawn(io, relay.run(), [&](std::exception_ptr, rr::EndReason why) {
      reason = std::move(why);
      took = std::chrono::duration_cast<milliseconds>(std::chrono::steady_clock::now() - begin);
    });
    io.run_for(stop_after);
    relay.stop({1001, "stopped"});
    client.client->close();
    device.server->close();
    io.restart();
    io.run();
  }

  std::size_t sent = 0;
  std::size_t received = 0;
  rr::EndReason reason;
  milliseconds took{};
};

/// Has no memory for what it reads.
class FullStream final : public rr::ByteStream {
 public:
  explicit FullStream(std::unique_ptr<rr::ByteStream> inner) : inner_(std::move(inner)) {}

  rr::awaitable<rr::ReadResult> read_some(std::span<std::uint8_t> into) override {
    static_cast<void>(co_await inner_->read_some(into));
    throw std::bad_alloc();
  }
  rr::awaitable<rr::error_code> write(std::span<const rr::ByteSpan> slices) override { return inner_->write(slices); }
  void finish_sending() override { inner_->finish_sending(); }
  void cancel() override { inner_->cancel(); }
  rr::awaitable<void> end(const rr::EndReason& reason) override { return inner_->end(reason); }
  void close() override { inner_->close(); }
  std::string peer() const override { return inner_->peer(); }
  boost::asio::any_io_executor executor() override { return inner_->executor(); }

 private:
  std::unique_ptr<rr::ByteStream> inner_;
};

}  // namespace

TEST_CASE("what is encrypted end to end passes whole, at a bounded rate") {
  const OpaqueRun run(600'000, 1'000'000);
  CHECK(run.received == run.sent);
  CHECK(run.took >= milliseconds(400));
  CHECK(run.took < milliseconds(10'000));
}

TEST_CASE("a relay that keeps its pace stops at once") {
  const OpaqueRun run(600'000, 1024, milliseconds(100));
  CHECK(run.received < run.sent);
  CHECK(run.reason.text == "stopped");
  CHECK(run.took < milliseconds(5'000));
}

TEST_CASE("while one side takes nothing, the relay takes no more from the other than it may hold") {
  const std::size_t outbox_bytes = GENERATE(1000u, 20'000u);
  boost::asio::io_context io(1);
  rr::test::MemoryStreams client(io.get_executor(), 5'000);
  rr::test::MemoryStreams device(io.get_executor());
  Traffic traffic;
  MemoryBudget budget(1'000'000'000);
  Relay relay(*client.server, *device.client, {5'000'000, outbox_bytes, 1'000'000'000}, traffic,
              budget.charge("client"));
  rr::Bytes message(1'000'000);
  constexpr std::array<std::uint8_t, 10> start{'R', 'R', 'A', 'C', 0x40, 0x42, 0x0f, 0, 2, 0};  // of as many bytes
  std::copy(start.begin(), start.end(), message.begin());
  const rr::ByteSpan slice(message);
  const std::span<const rr::ByteSpan> slices(&slice, 1);
  boost::asio::co_spawn(io, device.server->write(slices), boost::asio::detached);
  boost::asio::co_spawn(io, relay.run(), boost::asio::detached);
  io.poll();
  const auto read = device.to_client->carried - device.to_client->bytes.size();
  CHECK(read - traffic.to_clients.bytes == outbox_bytes);
  CHECK(traffic.to_clients.waiting == outbox_bytes);
  CHECK(budget.used() == outbox_bytes);
  relay.stop({1001, "stopped"});
  client.client->close();
  device.server->close();
  io.restart();
  io.run();
}

TEST_CASE("a relay ends by what the device says when it closes its WebSocket") {
  boost::asio::io_context io(1);
  rr::test::MemoryStreams client(io.get_executor());
  rr::test::MemoryStreams device(io.get_executor());
  rr::WebSocketStream to_device(std::move(device.client), rr::WebSocketRole::client, false);
  rr::WebSocketStream at_device(std::move(device.server), rr::WebSocketRole::server, true);
  Traffic traffic;
  MemoryBudget budget(1'000'000);
  Relay relay(*client.server, to_device, {5'000'000, 20'000, 1'000'000'000}, traffic, budget.charge("client"));
  std::string text;
  boost::asio::co_spawn(io, relay.run(), [&](std::exception_ptr, const rr::EndReason& why) { text = why.text; });
  const rr::EndReason reason{1008, "not allowed"};
  boost::asio::co_spawn(io, at_device.end(reason), boost::asio::detached);
  io.run();
  CHECK(text == "device closed the connection: code 1008, 'not allowed'");
}

TEST_CASE("a direction without memory ends the relay, and the other direction with it") {
  const bool is_client = GENERATE(true, false);
  boost::asio::io_context io(1);
  rr::test::MemoryStreams client(io.get_executor());
  rr::test::MemoryStreams device(io.get_executor());
  FullStream full(std::move(is_client ? client.server : device.client));
  rr::ByteStream& client_end = is_client ? static_cast<rr::ByteStream&>(full) : *client.server;
  rr::ByteStream& device_end = is_client ? *device.client : static_cast<rr::ByteStream&>(full);
  Traffic traffic;
  MemoryBudget budget(1'000'000);
  Relay relay(client_end, device_end, {5'000'000, 65'536, 1'000'000}, traffic, budget.charge("client"));
  rr::EndReason reason;
  std::exception_ptr failure;
  boost::asio::co_spawn(io, relay.run(), [&](std::exception_ptr thrown, rr::EndReason why) {
    failure = thrown;
    reason = std::move(why);
  });
  const rr::Bytes message(10);
  const rr::ByteSpan slice(message);
  const std::span<const rr::ByteSpan> slices(&slice, 1);
  boost::asio::co_spawn(io, (is_client ? client.client : device.server)->write(slices), boost::asio::detached);
  io.run();
  CHECK_FALSE(failure);
  CHECK(reason.code == 1011);
  CHECK(reason.text == "the gateway has no memory left");
}
