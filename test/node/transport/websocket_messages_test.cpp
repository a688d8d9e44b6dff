#include "node/transport/websocket_messages.hpp"

#include <boost/asio/co_spawn.hpp>
#include <boost/asio/detached.hpp>
#include <boost/asio/io_context.hpp>
#include <catch2/catch.hpp>
#include <string>
#include <vector>

#include "test/node/transport/memory_stream.hpp"

using namespace rr;

namespace {

/// A client's frame, with the length in as many bytes as it needs.
Bytes frame(std::uint8_t first, std::string_view payload) {
  Bytes out{first};
  const auto size = payload.size();
  if (size < 126) {
    out.push_back(static_cast<std::uint8_t>(0x80 | size));
  } else {
    out.push_back(0x80 | 126);
    out.push_back(static_cast<std::uint8_t>(size >> 8));
    out.push_back(static_cast<std::uint8_t>(size));
  }
  const std::uint8_t mask[] = {0x12, 0xa4, 0x00, 0xff};
  out.insert(out.end(), mask, mask + 4);
  for (std::size_t i = 0; i < size; ++i)
    out.push_back(static_cast<std::uint8_t>(static_cast<std::uint8_t>(payload[i]) ^ mask[i % 4]));
  return out;
}

Bytes operator+(Bytes left, const Bytes& right) {
  left.insert(left.end(), right.begin(), right.end());
  return left;
}

/// What a client said, as one line each.
std::vector<std::string> heard(WebSocketMessageDecoder& decoder, ByteSpan bytes) {
  std::vector<std::string> out;
  while (!bytes.empty() && !decoder.received_close()) {
    const auto taken = decoder.feed(bytes);
    REQUIRE(taken.has_value());
    bytes = bytes.subspan(*taken);
    if (const auto message = decoder.take_message()) out.push_back("message " + *message);
    if (const auto ping = decoder.take_ping()) out.push_back("ping " + std::string(as_text(*ping)));
    if (decoder.received_close()) out.push_back("close " + std::to_string(decoder.received_close()->code));
  }
  return out;
}

std::uint16_t refusal(const Bytes& bytes, std::size_t max_message = 1000) {
  WebSocketMessageDecoder decoder(max_message);
  for (ByteSpan left(bytes); !left.empty();) {
    const auto taken = decoder.feed(left);
    if (!taken) return decoder.close_code();
    left = left.subspan(*taken);
    decoder.take_message();
    decoder.take_ping();
  }
  return 0;
}

}  // namespace

TEST_CASE("messages are the same however their bytes are split") {
  const std::string long_text(300, 'x');
  const auto bytes = frame(0x81, "hello") + frame(0x01, "two ") + frame(0x89, "still there?") + frame(0x80, "parts") +
                     frame(0x81, "") + frame(0x8a, "") + frame(0x81, long_text) + frame(0x88, "\x03\xe8");
  const std::vector<std::string> expected{"message hello", "ping still there?",    "message two parts",
                                          "message ",      "message " + long_text, "close 1000"};
  for (std::size_t cut = 0; cut <= bytes.size(); ++cut) {
    WebSocketMessageDecoder decoder(1000);
    auto out = heard(decoder, ByteSpan(bytes).first(cut));
    for (auto& each : heard(decoder, ByteSpan(bytes).subspan(cut))) out.push_back(each);
    CHECK(out == expected);
  }
}

TEST_CASE("what no client may send has a code to close with") {
  CHECK(refusal(frame(0x82, "x")) == 1003);
  CHECK(refusal(frame(0x81, "\xc3\x28")) == 1007);
  CHECK(refusal({0x81, 0x01}) == 1002);
  CHECK(refusal(frame(0xc1, "x")) == 1002);
  CHECK(refusal(frame(0x80, "x")) == 1002);
  CHECK(refusal(frame(0x01, "x") + frame(0x81, "x")) == 1002);
  CHECK(refusal(frame(0x09, "x")) == 1002);
  CHECK(refusal(frame(0x89, std::string(126, 'x'))) == 1002);
  CHECK(refusal(frame(0x83, "x")) == 1002);
  CHECK(refusal(frame(0x81, std::string(11, 'x')), 10) == 1009);
  CHECK(refusal(frame(0x01, "123456") + frame(0x80, "78901"), 10) == 1009);
  CHECK(refusal(frame(0x01, "12345") + frame(0x80, "67890"), 10) == 0);
}

TEST_CASE("a message that there is no room for ends the connection as far as it has come, with a code that says so") {
  boost::asio::io_context io(1);
  rr::test::MemoryStreams streams(io.get_executor());
  std::vector<std::size_t> asked;
  WebSocketMessages messages(*streams.server, 1000, [&](std::size_t bytes) {
    asked.push_back(bytes);
    return bytes <= 20;
  });
  std::vector<std::string> received;
  const auto serve = [&]() -> awaitable<void> {
    while (auto message = co_await messages.read()) received.push_back(std::move(*message));
    co_await messages.end(no_reason);
  };
  const auto send = [&](const Bytes& bytes) {
    streams.to_server->bytes.insert(streams.to_server->bytes.end(), bytes.begin(), bytes.end());
    streams.to_server->changed.cancel();
    io.restart();
    io.poll();
  };
  boost::asio::co_spawn(io, serve(), boost::asio::detached);
  send(frame(0x81, "a message of 20 byte"));
  send(frame(0x01, "the first ten"));
  CHECK(received == std::vector<std::string>{"a message of 20 byte"});
  CHECK(asked == std::vector<std::size_t>{0, 20, 0, 13, 13});  // nothing is held while the next one is waited for
  send(frame(0x00, "and more"));
  CHECK(asked.back() == 21);
  const auto& sent = streams.to_client->bytes;
  REQUIRE(sent.size() > 4);
  CHECK(sent[0] == 0x88);
  CHECK((sent[2] << 8 | sent[3]) == 1013);
}
