#include "node/transport/websocket_frames.hpp"

#include <catch2/catch.hpp>
#include <string>

using namespace rr;

namespace {

/// A client's frame: masked, with the length in as many bytes as `form` says (0: the shortest).
rr::Bytes frame(std::uint8_t first, std::string_view payload, int form = 0, bool is_masked = true) {
  rr::Bytes out{first};
  const std::uint8_t mask_bit = is_masked ? 0x80 : 0;
  const auto size = payload.size();
  if (form == 0) form = size < 126 ? 1 : size < 65536 ? 2 : 8;
  if (form == 1) {
    out.push_back(static_cast<std::uint8_t>(mask_bit | size));
  } else {
    out.push_back(static_cast<std::uint8_t>(mask_bit | (form == 2 ? 126 : 127)));
    for (int i = form - 1; i >= 0; --i)
      out.push_back(static_cast<std::uint8_t>(static_cast<std::uint64_t>(size) >> (8 * i)));
  }
  const std::uint8_t mask[] = {0x12, 0xa4, 0x00, 0xff};
  if (is_masked) out.insert(out.end(), mask, mask + 4);
  for (std::size_t i = 0; i < size; ++i)
    out.push_back(static_cast<std::uint8_t>(static_cast<std::uint8_t>(payload[i]) ^ (is_masked ? mask[i % 4] : 0)));
  return out;
}

rr::Bytes operator+(rr::Bytes left, const rr::Bytes& right) {
  left.insert(left.end(), right.begin(), right.end());
  return left;
}

std::string decoded(WebSocketDecoder& decoder, rr::Bytes bytes) {
  boost::system::error_code error;
  const auto size = decoder.decode(bytes, error);
  REQUIRE_FALSE(error);
  return std::string(rr::as_text(rr::ByteSpan(bytes).first(size)));
}

std::string text_of(std::size_t size) {
  std::string out;
  for (std::size_t i = 0; i < size; ++i) out += static_cast<char>(i * 7 + i / 256);
  return out;
}

}  // namespace

TEST_CASE("frames of any shape become one byte stream") {
  const auto big = text_of(70000);
  const auto bytes = frame(0x82, "hello ") + frame(0x02, "wor", 2) + frame(0x00, "l") + frame(0x80, "d") +
                     frame(0x82, "") + frame(0x80, "!", 8) + frame(0x82, big);
  WebSocketDecoder decoder(WebSocketRole::server);
  CHECK(decoded(decoder, bytes) == "hello world!" + big);
  CHECK_FALSE(decoder.has_seen_control());
}

TEST_CASE("split at every byte the payload is the same") {
  const auto bytes =
      frame(0x82, text_of(300)) + frame(0x89, "ping") + frame(0x82, text_of(9), 8) + frame(0x88, "\x03\xe8");
  for (std::size_t cut = 0; cut <= bytes.size(); ++cut) {
    WebSocketDecoder decoder(WebSocketRole::server);
    const auto middle = bytes.begin() + static_cast<std::ptrdiff_t>(cut);
    auto out = decoded(decoder, rr::Bytes(bytes.begin(), middle));
    out += decoded(decoder, rr::Bytes(middle, bytes.end()));
    CHECK(out == text_of(300) + text_of(9));
    CHECK(decoder.take_ping() == rr::Bytes{'p', 'i', 'n', 'g'});
    REQUIRE(decoder.received_close().has_value());
    CHECK(decoder.received_close()->code == 1000);
  }
  WebSocketDecoder decoder(WebSocketRole::server);
  std::string out;
  for (const auto byte : bytes) out += decoded(decoder, {byte});
  CHECK(out == text_of(300) + text_of(9));
}

TEST_CASE("control frames are noticed and take no part in the stream") {
  WebSocketDecoder decoder(WebSocketRole::server);
  CHECK(decoded(decoder,
                frame(0x82, "a") + frame(0x89, "1") + frame(0x89, "2") + frame(0x8a, "x") + frame(0x82, "b")) == "ab");
  CHECK(decoder.has_seen_control());
  CHECK(decoder.take_ping() == rr::Bytes{'2'});
  CHECK_FALSE(decoder.take_ping().has_value());
  CHECK(decoded(decoder, frame(0x82, "c") + frame(0x88, "\x03\xe9 bye") + frame(0x82, "late")) == "c");
  REQUIRE(decoder.received_close().has_value());
  CHECK(decoder.received_close()->code == 1001);
  CHECK(decoder.received_close()->reason == " bye");
}

TEST_CASE("a close frame without a code is 1005") {
  WebSocketDecoder decoder(WebSocketRole::server);
  decoded(decoder, frame(0x88, ""));
  REQUIRE(decoder.received_close().has_value());
  CHECK(decoder.received_close()->code == 1005);
}

TEST_CASE("what RFC 6455 forbids is an error with its code") {
  const auto refuses = [](rr::Bytes bytes, WebSocketViolation violation, std::uint16_t code) {
    WebSocketDecoder decoder(WebSocketRole::server);
    boost::system::error_code error;
    (void)decoder.decode(bytes, error);
    CHECK(error == violation);
    CHECK(decoder.close_code() == code);
  };
  refuses(frame(0x81, "text"), WebSocketViolation::text_frame, 1003);
  refuses(frame(0xc2, "compressed"), WebSocketViolation::reserved_bits, 1002);
  refuses(frame(0x83, "reserved"), WebSocketViolation::reserved_opcode, 1002);
  refuses(frame(0x8b, "reserved"), WebSocketViolation::reserved_opcode, 1002);
  refuses(frame(0x82, "plain", 0, false), WebSocketViolation::no_mask, 1002);
  refuses(frame(0x09, "fragmented ping"), WebSocketViolation::control_frame, 1002);
  refuses(frame(0x89, std::string(126, 'x')), WebSocketViolation::control_frame, 1002);
  refuses({0x82, 0xff, 0x80, 0, 0, 0, 0, 0, 0, 0, 1, 2, 3, 4}, WebSocketViolation::frame_length, 1002);
  CHECK(make_error_code(WebSocketViolation::no_mask).message() == "WebSocket: frame of a client without mask");
}

TEST_CASE("unmask works at every alignment and in place") {
  const std::array<std::uint8_t, 4> mask{1, 2, 3, 4};
  for (std::size_t index = 0; index < 4; ++index) {
    for (std::size_t size = 0; size < 40; ++size) {
      rr::Bytes bytes(size + 3, 0);
      unmask(bytes.data() + 3, bytes.data(), size, mask, index);  // overlapping, three bytes down
      for (std::size_t i = 0; i < size; ++i) CHECK(bytes[i] == mask[(index + i) % 4]);
    }
  }
}

TEST_CASE("our frames are final, unmasked and at most 65535 bytes") {
  const auto first = text_of(65530);
  const auto second = text_of(65545);
  const rr::ByteSpan payload[] = {rr::as_bytes(first), rr::ByteSpan(), rr::as_bytes(second)};
  FrameSplitter splitter(WebSocketRole::server);
  rr::Bytes wire;
  for (const auto& slice : splitter.split(payload)) wire.insert(wire.end(), slice.begin(), slice.end());
  std::string out;
  std::vector<std::size_t> sizes;
  for (std::size_t at = 0; at < wire.size();) {
    REQUIRE(wire[at] == 0x82);
    REQUIRE((wire[at + 1] & 0x80) == 0);
    std::size_t size = wire[at + 1];
    at += 2;
    if (size == 126) {
      size = static_cast<std::size_t>(wire[at] << 8 | wire[at + 1]);
      at += 2;
    }
    REQUIRE(size != 127);
    sizes.push_back(size);
    out += rr::as_text(rr::ByteSpan(wire).subspan(at, size));
    at += size;
  }
  CHECK(sizes == std::vector<std::size_t>{65535, 65535, 5});
  CHECK(out == first + second);
  CHECK(splitter.split({}).empty());
}

TEST_CASE("a client's frames are masked anew each, and a server reads them") {
  const auto first = text_of(65530);
  const auto second = text_of(65545);
  const rr::ByteSpan payload[] = {rr::as_bytes(first), rr::as_bytes(second)};
  FrameSplitter splitter(WebSocketRole::client);
  rr::Bytes wire;
  for (const auto& slice : splitter.split(payload)) wire.insert(wire.end(), slice.begin(), slice.end());
  CHECK((wire[1] & 0x80) != 0);
  const ByteSpan first_mask = ByteSpan(wire).subspan(4, 4);
  const ByteSpan second_mask = ByteSpan(wire).subspan(8 + 65535 + 4, 4);
  CHECK_FALSE(std::equal(first_mask.begin(), first_mask.end(), second_mask.begin()));
  WebSocketDecoder decoder(WebSocketRole::server);
  CHECK(decoded(decoder, wire) == first + second);
  auto pong = make_control_frame(WebSocketRole::client, WebSocketOpcode::ping, rr::as_bytes("hello"));
  CHECK(decoded(decoder, pong).empty());
  CHECK(decoder.take_ping() == rr::Bytes{'h', 'e', 'l', 'l', 'o'});
}

TEST_CASE("a frame that was written in part goes on with the payload that comes next") {
  const auto first = text_of(200);
  const auto urgent = text_of(70);
  const auto second = text_of(65600);
  for (const auto role : {WebSocketRole::client, WebSocketRole::server}) {
    for (std::size_t step = 1; step < 300; ++step) {
      FrameSplitter splitter(role);
      rr::Bytes wire;
      std::string left = first + second;
      std::string expected;
      for (std::size_t round = 0; !left.empty(); ++round) {
        if (round == 2) left.insert(0, urgent);  // the queue has put something ahead
        const rr::ByteSpan payload[] = {rr::as_bytes(left).first(left.size() / 2),
                                        rr::as_bytes(left).subspan(left.size() / 2)};
        rr::Bytes laid_out;
        for (const auto& slice : splitter.split(payload, 40'000))
          laid_out.insert(laid_out.end(), slice.begin(), slice.end());
        laid_out.resize(std::min(laid_out.size(), round < 4 ? step : laid_out.size()));
        wire.insert(wire.end(), laid_out.begin(), laid_out.end());
        const auto written = splitter.consume(laid_out.size());
        expected += left.substr(0, written);
        left.erase(0, written);
      }
      CHECK_FALSE(splitter.is_in_frame());
      WebSocketDecoder decoder(role == WebSocketRole::client ? WebSocketRole::server : WebSocketRole::client);
      REQUIRE(decoded(decoder, wire) == expected);
    }
  }
}

TEST_CASE("a client reads plain frames, and masked ones as the reference does") {
  WebSocketDecoder decoder(WebSocketRole::client);
  CHECK(decoded(decoder, frame(0x82, "plain", 0, false) + frame(0x82, "masked")) == "plainmasked");
}

TEST_CASE("control frames are cut to their bound") {
  CHECK(make_control_frame(WebSocketRole::server, WebSocketOpcode::pong, rr::as_bytes(std::string(200, 'x'))).size() ==
        127);
  CHECK(make_close_frame(WebSocketRole::server, 1005, "x") == rr::Bytes{0x88, 0});
  CHECK(make_close_frame(WebSocketRole::server, 1000, "ok") == rr::Bytes{0x88, 4, 0x03, 0xe8, 'o', 'k'});
  const auto cut = make_close_frame(WebSocketRole::server, 1011,
                                    std::string(122, 'a') + "\xc3\xa4");  // the umlaut would be cut in two
  CHECK(cut.size() == 2 + 2 + 122);
}

TEST_CASE("a close frame is answered with its code; where none has come, the reason is told") {
  const auto own = make_close_frame(WebSocketRole::server, std::nullopt, 1001, "bye");
  CHECK(own == make_close_frame(WebSocketRole::server, 1001, "bye"));
  const CloseFrame received{1000, "done"};
  CHECK(make_close_frame(WebSocketRole::server, received, 1001, "bye") == rr::Bytes{0x88, 2, 0x03, 0xe8});
}

TEST_CASE("the accept value of RFC 6455's example") {
  CHECK(websocket_accept("dGhlIHNhbXBsZSBub25jZQ==") == "s3pPLMBiTxaQ9kYGzzhZRbK+xOo=");
}
