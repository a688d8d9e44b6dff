#include "server/relay/frame_gate.hpp"

#include <catch2/catch.hpp>
#include <cstring>

#include "core/session/start_tls.hpp"

using namespace rrgate;

namespace {

rr::Bytes message(std::uint32_t size, std::uint16_t version = 2) {
  rr::Bytes out(size, 0x55);
  std::memcpy(out.data(), "RRAC", 4);
  std::memcpy(out.data() + 4, &size, 4);
  std::memcpy(out.data() + 8, &version, 2);
  return out;
}

/// Offers a stream in pieces of `step` bytes, as a relay does; returns what passed.
rr::Bytes offer(FrameGate& gate, const rr::Bytes& stream, std::size_t step) {
  rr::Bytes held;
  rr::Bytes passed;
  for (std::size_t at = 0; at < stream.size(); at += step) {
    const auto piece = rr::ByteSpan(stream).subspan(at, std::min(step, stream.size() - at));
    held.insert(held.end(), piece.begin(), piece.end());
    const auto count = gate.pass(held);
    REQUIRE(count.has_value());
    REQUIRE(held.size() - *count < 10);
    passed.insert(passed.end(), held.begin(), held.begin() + static_cast<std::ptrdiff_t>(*count));
    held.erase(held.begin(), held.begin() + static_cast<std::ptrdiff_t>(*count));
  }
  return passed;
}

}  // namespace

TEST_CASE("messages pass however they are cut") {
  rr::Bytes stream;
  for (const std::uint32_t size : {16u, 100u, 17u, 5000u, 16u}) {
    const auto one = message(size, size % 2 == 0 ? 4 : 2);
    stream.insert(stream.end(), one.begin(), one.end());
  }
  for (std::size_t step = 1; step < 60; ++step) {
    FrameGate gate(5000);
    CHECK(offer(gate, stream, step) == stream);
  }
  FrameGate gate(5000);
  CHECK(offer(gate, stream, stream.size()) == stream);
}

TEST_CASE("no byte of a message above the limit passes") {
  FrameGate gate(5000);
  rr::Bytes stream = message(20);
  CHECK(gate.pass(stream).value() == 20);
  stream = message(5001);
  CHECK_FALSE(gate.pass(rr::ByteSpan(stream).first(10)).has_value());
  CHECK(gate.is_too_large());
}

TEST_CASE("anything but a message start is refused at its first wrong byte") {
  const auto refuses = [](rr::Bytes bytes) {
    FrameGate gate(5000);
    CHECK_FALSE(gate.pass(bytes).has_value());
    CHECK_FALSE(gate.is_too_large());
  };
  refuses({'R', 'R', 'X'});
  const auto text = rr::as_bytes("not a message");
  refuses(rr::Bytes(text.begin(), text.end()));
  refuses(message(16, 3));
  auto small = message(16);
  small[4] = 15;
  refuses(small);
}

TEST_CASE("an opaque stream passes unread") {
  FrameGate gate(5000);
  gate.make_opaque();
  CHECK(gate.pass(rr::Bytes{0x16, 3, 1}).value() == 3);
}

TEST_CASE("a service's consent to TLS is seen, however it is cut, and its refusal is none") {
  const rr::NodeIdentity self{rr::NodeId{{1}}, "device"};
  const auto reply_to = [&](bool can_start_tls) {
    return rr::answer_first_request(rr::make_start_tls({}, true), self, can_start_tls).value().reply;
  };
  for (const std::size_t step : {1u, 7u, 1000u}) {
    FrameGate gate(5000);
    offer(gate, reply_to(false), step);
    CHECK_FALSE(gate.has_seen_start_tls());
    offer(gate, reply_to(true), step);
    CHECK(gate.has_seen_start_tls());
  }
  FrameGate from_client(5000);
  offer(from_client, rr::make_start_tls({}, true), 1000);
  CHECK_FALSE(from_client.has_seen_start_tls());
  FrameGate late(5000);
  for (int i = 0; i < 8; ++i) offer(late, message(16), 16);
  offer(late, reply_to(true), 1000);
  CHECK_FALSE(late.has_seen_start_tls());
}
