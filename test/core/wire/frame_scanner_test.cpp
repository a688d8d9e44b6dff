#include "core/wire/frame_scanner.hpp"

#include <algorithm>
#include <catch2/catch.hpp>

#include "test/core/wire/vectors.hpp"
#include "test/support/print.hpp"

using namespace rr;
using namespace rr::test;

namespace {

/// A start of ten bytes and `size - 10` bytes of content; the scanner looks at no more.
Bytes make_frame(std::uint32_t size, std::uint16_t version = 4) {
  Bytes frame = from_hex("52524143");
  for (int shift = 0; shift < 32; shift += 8) frame.push_back(static_cast<std::uint8_t>(size >> shift));
  frame.push_back(static_cast<std::uint8_t>(version));
  frame.push_back(static_cast<std::uint8_t>(version >> 8));
  while (frame.size() < size) frame.push_back(static_cast<std::uint8_t>(frame.size()));
  return frame;
}

Bytes operator+(Bytes a, const Bytes& b) {
  a.insert(a.end(), b.begin(), b.end());
  return a;
}

bool holds(const FrameScanner& scanner, const Bytes& expected) {
  return scanner.message() &&
         std::equal(scanner.message()->begin(), scanner.message()->end(), expected.begin(), expected.end());
}

}  // namespace

TEST_CASE("a message that lies in one piece is handed out without a copy") {
  const auto stream = make_frame(40) + make_frame(16);
  FrameScanner scanner;
  REQUIRE(scanner.feed(stream).value() == 40);
  REQUIRE(scanner.message());
  CHECK(scanner.message()->data() == stream.data());
  CHECK(scanner.message()->size() == 40);

  REQUIRE(scanner.feed(ByteSpan(stream).subspan(40)).value() == 16);
  REQUIRE(scanner.message());
  CHECK(scanner.message()->data() == stream.data() + 40);

  REQUIRE(scanner.feed({}).value() == 0);
  CHECK_FALSE(scanner.message());
}

TEST_CASE("a message split anywhere comes out whole") {
  const auto first = make_frame(37);
  const auto second = make_frame(25, 2);
  const auto stream = first + second;
  for (std::size_t split = 0; split <= stream.size(); ++split) {
    INFO("split at " << split);
    FrameScanner scanner;
    std::vector<Bytes> found;
    std::size_t fed = 0;
    for (auto piece : {ByteSpan(stream).first(split), ByteSpan(stream).subspan(split)}) {
      fed += piece.size();
      while (!piece.empty()) {
        const auto consumed = scanner.feed(piece);
        REQUIRE(consumed);
        REQUIRE(*consumed > 0);
        piece = piece.subspan(*consumed);
        if (scanner.message()) found.emplace_back(scanner.message()->begin(), scanner.message()->end());
      }
      REQUIRE(found.size() == (fed < first.size() ? 0 : fed < stream.size() ? 1 : 2));
    }
    REQUIRE(found.size() == 2);
    CHECK(found[0] == first);
    CHECK(found[1] == second);
  }
}

TEST_CASE("every recorded message comes out whole, split at every byte and byte by byte") {
  for (const auto& vector : message_vectors()) {
    INFO(vector.name);
    const ByteSpan bytes = vector.bytes;
    const std::size_t step = bytes.size() > 4000 ? bytes.size() / 64 : 1;
    for (std::size_t split = 1; split < bytes.size(); split += step) {
      FrameScanner scanner;
      REQUIRE(scanner.feed(bytes.first(split)).value() == split);
      REQUIRE_FALSE(scanner.message());
      REQUIRE(scanner.feed(bytes.subspan(split)).value() == bytes.size() - split);
      REQUIRE(holds(scanner, vector.bytes));
    }
    FrameScanner scanner;
    for (std::size_t at = 0; at < bytes.size(); ++at) {
      if (scanner.message()) FAIL("complete after " << at << " bytes");
      if (!scanner.feed(bytes.subspan(at, 1))) FAIL("refused at byte " << at);
    }
    REQUIRE(holds(scanner, vector.bytes));
  }
}

TEST_CASE("a wrong magic is refused at its first wrong byte") {
  for (std::size_t wrong = 0; wrong < 4; ++wrong) {
    auto frame = make_frame(20);
    frame[wrong] ^= 0x20;
    FrameScanner whole;
    CHECK_FALSE(whole.feed(frame));
    FrameScanner scanner;
    for (std::size_t at = 0; at < wrong; ++at) REQUIRE(scanner.feed(ByteSpan(frame).subspan(at, 1)));
    const auto refused = scanner.feed(ByteSpan(frame).subspan(wrong, 1));
    REQUIRE_FALSE(refused);
    CHECK(refused.error().code == ErrorCode::protocol_error);
    CHECK(refused.error().message.rfind("magic at byte 0: found ", 0) == 0);
  }
}

TEST_CASE("sizes and versions outside the bounds are refused before the tenth byte is passed") {
  const auto refusal = [](const Bytes& frame, std::size_t limit) {
    FrameScanner scanner(limit);
    const auto fed = scanner.feed(ByteSpan(frame).first(10));
    return fed ? std::string("accepted") : fed.error().message;
  };
  CHECK(refusal(make_frame(16), 1000) == "accepted");
  CHECK(refusal(make_frame(15), 1000) == "MessageSize at byte 4: 15 is below the minimum of 16");
  CHECK(refusal(make_frame(0), 1000) == "MessageSize at byte 4: 0 is below the minimum of 16");
  CHECK(refusal(make_frame(1000), 1000) == "accepted");
  CHECK(refusal(make_frame(1001), 1000) == "MessageSize at byte 4: 1001 is above the limit of 1000");
  CHECK(refusal(make_frame(20, 3), 1000) == "version at byte 8: found 3, expected 2 or 4");
  CHECK(refusal(make_frame(20, 0x0400), 1000) == "version at byte 8: found 1024, expected 2 or 4");

  auto huge = make_frame(20);
  std::fill_n(huge.begin() + 4, 4, std::uint8_t{0xff});
  FrameScanner scanner;
  CHECK_FALSE(scanner.feed(ByteSpan(huge).first(8)));  // the size alone is enough
}

TEST_CASE("a new limit holds from the next message on") {
  const auto frame = make_frame(100);
  FrameScanner scanner(100);
  REQUIRE(scanner.feed(ByteSpan(frame).first(50)));
  scanner.set_max_message_size(99);
  REQUIRE(scanner.feed(ByteSpan(frame).subspan(50)));
  CHECK(holds(scanner, frame));
  CHECK_FALSE(scanner.feed(frame));
}
