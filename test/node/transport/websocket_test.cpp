#include "node/transport/websocket.hpp"

#include <boost/asio/co_spawn.hpp>
#include <boost/asio/detached.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/use_awaitable.hpp>
#include <catch2/catch.hpp>
#include <string>

#include "node/transport/http_connect.hpp"
#include "test/node/transport/memory_stream.hpp"

using namespace rr;
using namespace rr::test;

namespace asio = boost::asio;

namespace {

/// Takes a few bytes at once without waiting, as a socket does whose buffer is nearly full.
class StingyStream final : public ByteStream {
 public:
  StingyStream(std::unique_ptr<ByteStream> inner, std::size_t& budget) : inner_(std::move(inner)), budget_(budget) {}

  awaitable<ReadResult> read_some(std::span<std::uint8_t> into) override { return inner_->read_some(into); }
  std::size_t try_write(std::span<const ByteSpan> slices, error_code& error) override {
    error = {};
    std::size_t written = 0;
    Bytes taken;
    for (const auto& slice : slices) {
      const auto part = slice.first(std::min(slice.size(), budget_ - written));
      taken.insert(taken.end(), part.begin(), part.end());
      written += part.size();
    }
    budget_ -= written;
    const ByteSpan slice(taken);
    const std::span<const ByteSpan> all(&slice, 1);
    if (written == 0) return 0;
    auto work = [](ByteStream& inner, Bytes bytes) -> awaitable<void> {
      const ByteSpan span(bytes);
      const std::span<const ByteSpan> spans(&span, 1);
      co_await inner.write(spans);
    };
    asio::co_spawn(executor(), work(*inner_, std::move(taken)), asio::detached);
    return written;
  }
  awaitable<error_code> write(std::span<const ByteSpan> slices) override { return inner_->write(slices); }
  void finish_sending() override { inner_->finish_sending(); }
  void cancel() override { inner_->cancel(); }
  awaitable<void> end(const EndReason& reason) override { return inner_->end(reason); }
  void close() override { inner_->close(); }
  std::string peer() const override { return inner_->peer(); }
  asio::any_io_executor executor() override { return inner_->executor(); }

 private:
  std::unique_ptr<ByteStream> inner_;
  std::size_t& budget_;
};

/// Has a ping, which it gives as soon as the loop comes round, and then nothing.
class PingStream final : public ByteStream {
 public:
  explicit PingStream(asio::any_io_executor executor) : executor_(std::move(executor)) {}

  awaitable<ReadResult> read_some(std::span<std::uint8_t> into) override {
    co_await asio::post(executor_, asio::use_awaitable);
    if (reads++ > 0) co_return ReadResult{asio::error::timed_out, 0};
    const auto ping = make_control_frame(WebSocketRole::client, WebSocketOpcode::ping, {});
    std::copy(ping.begin(), ping.end(), into.begin());
    co_return ReadResult{{}, ping.size()};
  }
  awaitable<error_code> write(std::span<const ByteSpan>) override { co_return error_code(); }
  void finish_sending() override {}
  void cancel() override {}
  awaitable<void> end(const EndReason&) override { co_return; }
  void close() override {}
  std::string peer() const override { return "ping"; }
  asio::any_io_executor executor() override { return executor_; }

  int reads = 0;

 private:
  asio::any_io_executor executor_;
};

struct Pair {
  explicit Pair(WebSocketRole role)
      : near(std::make_unique<StingyStream>(std::move(streams.client), budget), role, false),
        far(std::move(streams.server), role == WebSocketRole::client ? WebSocketRole::server : WebSocketRole::client,
            false) {}

  std::size_t try_write(std::string_view text) {
    const ByteSpan slice = as_bytes(text);
    error_code error;
    const auto written = near.try_write({&slice, 1}, error);
    REQUIRE_FALSE(error);
    run();
    return written;
  }
  void write(std::string_view text) {
    auto work = [](WebSocketStream& stream, std::string_view payload) -> awaitable<void> {
      const ByteSpan slice = as_bytes(payload);
      const std::span<const ByteSpan> slices(&slice, 1);
      const auto error = co_await stream.write(slices);
      CHECK_FALSE(error);
    };
    asio::co_spawn(io, work(near, text), asio::detached);
    run();
  }
  /// Reads at the near side, which answers pings meanwhile.
  void read_near() {
    auto work = [](WebSocketStream& stream, bool& is_over) -> awaitable<void> {
      Bytes buffer(1000);
      co_await stream.read_some(buffer);
      is_over = true;
    };
    asio::co_spawn(io, work(near, near_read_is_over), asio::detached);
    run();
  }
  std::string read_far() {
    std::string out;
    auto work = [](WebSocketStream& stream, std::string& payload) -> awaitable<void> {
      Bytes buffer(100'000);
      const auto read = co_await stream.read_some(buffer);
      payload = as_text(ByteSpan(buffer).first(read.bytes));
    };
    asio::co_spawn(io, work(far, out), asio::detached);
    run();
    return out;
  }
  void run() {
    io.restart();
    io.poll();
  }

  asio::io_context io;
  std::size_t budget = 0;
  MemoryStreams streams{io.get_executor()};
  WebSocketStream near;
  WebSocketStream far;
  bool near_read_is_over = false;
};

}  // namespace

TEST_CASE("what a stream takes at once is counted as payload, and a frame's rest follows its beginning") {
  const auto role = GENERATE(WebSocketRole::client, WebSocketRole::server);
  const std::string text = "forty bytes of payload for a small frame";
  for (std::size_t first = 0; first <= text.size() + 6; ++first) {
    Pair pair(role);
    pair.budget = first;
    const std::size_t header = role == WebSocketRole::client ? 6 : 2;
    const auto written = pair.try_write(text);
    CHECK(written == (first < header ? 0 : std::min(first - header, text.size())));
    const auto rest = std::string_view(text).substr(written);
    if (!rest.empty()) pair.write(rest);
    CHECK(pair.read_far() == text);
    pair.budget = 1000;
    CHECK(pair.try_write("next") == 4);
    CHECK(pair.read_far() == "next");
  }
}

TEST_CASE("a frame's rest may be written in parts") {
  Pair pair(GENERATE(WebSocketRole::client, WebSocketRole::server));
  pair.budget = 7;
  const std::string_view text = "payload";
  const auto written = pair.try_write(text);
  REQUIRE(written < 7);
  REQUIRE(written > 0);
  for (auto rest = text.substr(written); !rest.empty();) {
    const auto part = rest.substr(0, 2);
    pair.write(part);
    rest = rest.substr(part.size());
  }
  pair.write("next");
  CHECK(pair.read_far() == "payloadnext");
}

TEST_CASE("a pong waits for the end of a frame that is written in part") {
  Pair pair(WebSocketRole::server);
  pair.budget = 5;
  REQUIRE(pair.try_write("payload") == 3);
  const auto ping = make_control_frame(WebSocketRole::client, WebSocketOpcode::ping, as_bytes("hello"));
  pair.streams.to_client->bytes.assign(ping.begin(), ping.end());
  pair.read_near();
  const auto carried = pair.streams.to_server->carried;
  pair.write("load");
  CHECK(pair.streams.to_server->carried == carried + 4 + 2 + 5);
  CHECK(pair.read_far() == "payload");
}

TEST_CASE("closing lets go of a pong that waits for the end of a frame") {
  Pair pair(WebSocketRole::server);
  pair.budget = 5;
  REQUIRE(pair.try_write("payload") == 3);
  const auto ping = make_control_frame(WebSocketRole::client, WebSocketOpcode::ping, {});
  pair.streams.to_client->bytes.assign(ping.begin(), ping.end());
  pair.read_near();
  REQUIRE_FALSE(pair.near_read_is_over);
  pair.near.close();
  pair.run();
  CHECK(pair.near_read_is_over);
  const std::string text = "more";
  const ByteSpan slice = as_bytes(text);
  error_code error;
  CHECK(pair.near.try_write({&slice, 1}, error) == 0);
  CHECK(error);
}

TEST_CASE("a pong comes before the next frame of who writes without a pause") {
  Pair pair(WebSocketRole::server);
  pair.streams.to_server->limit = 10;  // each write waits for the far side
  bool is_over = false;
  auto write_on = [](WebSocketStream& stream, bool& is_done) -> awaitable<void> {
    const std::string text = "payload of a frame";
    const ByteSpan slice = as_bytes(text);
    const std::span<const ByteSpan> slices(&slice, 1);
    for (int i = 0; i < 1000 && !co_await stream.write(slices); ++i) {
    }
    is_done = true;
  };
  asio::co_spawn(pair.io, write_on(pair.near, is_over), asio::detached);
  pair.run();
  const auto ping = make_control_frame(WebSocketRole::client, WebSocketOpcode::ping, as_bytes("hello"));
  auto& to_client = *pair.streams.to_client;
  to_client.bytes.assign(ping.begin(), ping.end());
  const auto data = make_control_frame(WebSocketRole::client, WebSocketOpcode::binary, as_bytes("order"));
  to_client.bytes.insert(to_client.bytes.end(), data.begin(), data.end());
  pair.read_near();
  for (int i = 0; i < 10 && !pair.near_read_is_over; ++i) {
    to_client.changed.cancel();
    pair.read_far();
  }
  CHECK(pair.near_read_is_over);
  CHECK_FALSE(is_over);
  pair.near.close();
  pair.run();
}

TEST_CASE("a read that is cancelled between two of its steps ends") {
  asio::io_context io(1);
  auto inner = std::make_unique<PingStream>(io.get_executor());
  const auto& pings = *inner;
  WebSocketStream socket(std::move(inner), WebSocketRole::server, false);
  Bytes room(100);
  ReadResult result;
  asio::co_spawn(io, socket.read_some(room), [&](std::exception_ptr, ReadResult read) { result = read; });
  REQUIRE(io.run_one() == 1);  // has asked for bytes
  socket.cancel();
  io.run();
  CHECK(result.error == asio::error::operation_aborted);
  CHECK(pings.reads == 1);
}

TEST_CASE("a server is asked for its address without the zone") {
  const std::pair<const char*, const char*> hosts[] = {
      {"rr+ws://[fe80::1%25eth0]:81/?service=x", "Host: [fe80::1]:81\r\n"},
      {"rr+ws://[fe80::1%25eth0]/?service=x", "Host: [fe80::1]\r\n"},
      {"rr+ws://robot:81/?service=x", "Host: robot:81\r\n"}};
  for (const auto& [url, line] : hosts) {
    asio::io_context io;
    MemoryStreams streams{io.get_executor()};
    asio::co_spawn(io, connect_websocket(std::move(streams.client), parse_url(url).value(), {}), asio::detached);
    std::string request;
    auto work = [](ByteStream& server, std::string& into) -> awaitable<void> {
      Bytes buffer(10'000);
      const auto read = co_await server.read_some(buffer);
      into = as_text(ByteSpan(buffer).first(read.bytes));
    };
    asio::co_spawn(io, work(*streams.server, request), asio::detached);
    io.poll();
    CHECK_THAT(request, Catch::Contains(line));
    streams.server->close();
    io.poll();
  }
}
