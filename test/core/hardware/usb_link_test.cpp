#include "core/hardware/usb_link.hpp"

#include <catch2/catch.hpp>
#include <map>
#include <numeric>

#include "core/support/hex.hpp"
#include "test/core/hardware/simulated_device.hpp"
#include "test/support/golden.hpp"
#include "test/support/print.hpp"

using namespace rr;
using namespace rr::test;

namespace {

/// A link and a device, and the bus between them, which does one round of everything at a time.
struct Bus {
  explicit Bus(SimulatedDeviceOptions device_options = {}, UsbLinkOptions link_options = {})
      : device(device_options),
        link({{0x81, true, device_options.packet_size}, {0x02, true, device_options.packet_size}},
             device_options.interface, link_options) {}

  /// Until nothing changes any more.
  void run() {
    while (step()) {
    }
  }

  bool step() {
    bool has_changed = false;
    if (const auto request = link.poll_control()) {
      const auto reply = device.control(*request);
      link.handle_control(reply.status, reply.data);
      has_changed = true;
    }
    while (const auto write = link.poll_write())
      writes.push_back({write->slot, Bytes(write->bytes.begin(), write->bytes.end())});
    while (!writes.empty()) {
      const auto status = device.bulk_out(writes.front().second);
      if (!status) break;
      link.handle_written(writes.front().first, *status, *status == UsbStatus::ok ? writes.front().second.size() : 0);
      writes.erase(writes.begin());
      has_changed = true;
    }
    while (const auto read = link.poll_read()) reads.push_back(*read);
    while (!reads.empty()) {
      const auto reply = device.bulk_in();
      if (!reply) break;
      REQUIRE(reply->data.size() <= reads.front().into.size());
      std::copy(reply->data.begin(), reply->data.end(), reads.front().into.begin());
      link.handle_read(reads.front().slot, reply->status, reply->data.size(), now);
      reads.erase(reads.begin());
      has_changed = true;
      if (link.state() == UsbLinkState::closed) break;
    }
    while (const auto event = link.poll_event()) events.push_back(*event);
    return has_changed;
  }

  UsbStreamKey open() {
    const auto key = link.open_stream();
    run();
    REQUIRE(link.is_open(key));
    return key;
  }

  std::string closed_reason(UsbStreamKey key) const {
    std::string reason = "not closed";
    for (const auto& event : events)
      if (event.stream == key && event.kind == UsbEventKind::closed) {
        REQUIRE(reason == "not closed");  // once only
        reason = event.reason.message;
      }
    return reason;
  }

  Bytes read_all(UsbStreamKey key) {
    Bytes out(link.unread_bytes(key));
    REQUIRE(link.read(key, out) == out.size());
    return out;
  }

  SimulatedDevice device;
  UsbLink link;
  TimePoint now{};
  std::vector<std::pair<std::size_t, Bytes>> writes;
  std::vector<UsbRead> reads;
  std::vector<UsbEvent> events;
};

Bytes pattern(std::size_t size, unsigned seed = 1) {
  Bytes out(size);
  for (auto& byte : out) byte = static_cast<std::uint8_t>((seed = seed * 1103515245u + 12345u) >> 16);
  return out;
}

std::string describe(const UsbControl& request) {
  return hex_text(request.request_type, 2) + " " + hex_text(request.request, 2) + " " + hex_text(request.value, 4) +
         " " + hex_text(request.index, 4) + " " + std::to_string(request.length) +
         (request.data.empty() ? "" : ": " + to_hex(request.data));
}

}  // namespace

TEST_CASE("the first stream is opened and the last one closed as the reference does it") {
  SimulatedDevice device;
  UsbLink link({{0x81, true, 64}, {0x02, true, 64}}, 0);
  const auto expect_control = [&](const std::string& expected) {
    const auto request = link.poll_control();
    REQUIRE(request);
    CHECK(describe(*request) == expected);
    CHECK_FALSE(link.poll_control());  // one at a time
    const auto reply = device.control(*request);
    link.handle_control(reply.status, reply.data);
  };
  const auto key = link.open_stream();
  CHECK_FALSE(link.poll_write());
  CHECK_FALSE(link.poll_read());
  expect_control("c1 03 0000 0000 4");
  CHECK_FALSE(link.poll_control());  // not before the OUT pipe is in step
  const auto resync = link.poll_write();
  REQUIRE(resync);
  CHECK(resync->bytes.empty());
  CHECK_FALSE(link.poll_write());
  link.handle_written(resync->slot, UsbStatus::failed, 0);  // its result does not matter
  CHECK_FALSE(link.poll_read());
  expect_control("41 06 0000 0000 2: 0101");
  for (int posted = 0; posted < 4; ++posted) {
    const auto read = link.poll_read();
    REQUIRE(read);
    CHECK(read->into.size() == 64);
  }
  CHECK_FALSE(link.poll_read());
  CHECK(link.write(key, pattern(10)) == 0);  // not open yet
  expect_control("c1 01 0000 0000 4");
  CHECK(link.is_open(key));

  // 56 + 56 + 39 bytes.
  const auto message = pattern(151);
  CHECK(link.write(key, message) == 151);
  CHECK(link.unsent_bytes(key) == 151);
  for (const std::string start : {"4000000007000000", "4000000007000000", "2f00000007000000"}) {
    const auto write = link.poll_write();
    REQUIRE(write);
    CHECK(to_hex(write->bytes.first(8)) == start);
    CHECK(write->bytes.size() == write->bytes[0]);
  }
  CHECK(link.unsent_bytes(key) == 0);
  CHECK_FALSE(link.poll_write());
  CHECK_FALSE(link.is_sent(key));
  for (std::size_t slot = 0; slot < 3; ++slot) link.handle_written(slot, UsbStatus::ok, slot < 2 ? 64 : 47);
  CHECK(link.is_sent(key));

  link.close_stream(key);
  expect_control("41 02 0000 0000 4: 07000000");
  expect_control("c1 03 0000 0000 4");
  CHECK(link.state() == UsbLinkState::closed);
  CHECK_FALSE(link.poll_control());
  CHECK_FALSE(link.poll_read());
}

TEST_CASE("a message arrives whole at every payload size, in both directions") {
  for (const auto packet_size : std::initializer_list<std::uint16_t>{9, 10, 16, 63, 64, 512, 1024}) {
    Bus bus({.packet_size = packet_size, .max_input = 100'000});
    const auto key = bus.open();
    const auto largest = std::min<std::size_t>(3u * (packet_size - 8u) + 1, 1500);
    for (std::size_t size = 1; size <= largest; ++size) {
      const auto message = pattern(size, static_cast<unsigned>(size));
      REQUIRE(bus.link.write(key, message) == size);
      bus.device.send(7, message);
      bus.run();
      REQUIRE(bus.device.take_input(7) == message);
      REQUIRE(bus.read_all(key) == message);
    }
    CHECK(bus.link.is_sent(key));
    for (const auto& transfer : bus.device.out_log()) CHECK((transfer.empty() || transfer.size() > 8));
  }
}

TEST_CASE("several streams take turns and do not mix") {
  Bus bus;
  std::map<UsbStreamKey, Bytes> sent;
  for (int count = 0; count < 5; ++count) sent[bus.open()] = {};
  bus.device.take_opened();
  int at = 0;
  for (auto& [key, bytes] : sent) {
    bytes = pattern(1000, key);
    REQUIRE(bus.link.write(key, bytes) == bytes.size());
    bus.device.send(7 + at++, bytes);
  }
  // The first five sub-packets belong to five streams.
  std::map<std::int32_t, int> turns;
  for (int count = 0; count < 4; ++count) {
    const auto write = bus.link.poll_write();
    REQUIRE(write);
    ++turns[load<std::int32_t>(write->bytes.data() + 4)];
    bus.writes.push_back({write->slot, Bytes(write->bytes.begin(), write->bytes.end())});
  }
  CHECK(turns.size() == 4);
  CHECK_FALSE(bus.link.poll_write());  // four at once
  bus.run();
  at = 0;
  for (const auto& [key, bytes] : sent) {
    CHECK(bus.device.take_input(7 + at++) == bytes);
    CHECK(bus.read_all(key) == bytes);
  }
}

TEST_CASE("a stream that the device closes ends behind its last byte; the host does not close it again") {
  Bus bus;
  const auto first = bus.open();
  const auto second = bus.open();
  bus.device.send(7, pattern(100));
  bus.device.close(7);
  bus.run();
  CHECK(bus.closed_reason(first) == "closed by the device");
  CHECK_FALSE(bus.link.is_open(first));
  CHECK(bus.link.write(first, pattern(5)) == 0);
  CHECK(bus.read_all(first) == pattern(100));
  const auto requests = bus.device.control_log().size();
  bus.link.close_stream(first);
  bus.run();
  CHECK(bus.device.control_log().size() == requests);
  CHECK(bus.link.is_open(second));
  // Its id comes back for the next one.
  const auto third = bus.open();
  bus.link.write(third, pattern(20));
  bus.run();
  CHECK(bus.device.take_input(7) == pattern(20));
  bus.link.close_stream(second);
  bus.link.close_stream(third);
  bus.run();
  CHECK(bus.link.state() == UsbLinkState::closed);
}

TEST_CASE("a device that takes no more streams says so; the others go on") {
  Bus bus({.max_streams = 1});
  const auto first = bus.open();
  const auto refused = bus.link.open_stream();
  bus.run();
  CHECK(bus.closed_reason(refused) ==
        "USB device: stream refused: the device answered -1, which means that it takes no more");
  bus.link.close_stream(refused);
  bus.link.write(first, pattern(30));
  bus.run();
  CHECK(bus.device.take_input(7) == pattern(30));
}

TEST_CASE("a refused only stream closes the link") {
  Bus bus({.max_streams = 0});
  const auto refused = bus.link.open_stream();
  bus.run();
  CHECK(bus.closed_reason(refused) != "not closed");
  CHECK(bus.link.state() == UsbLinkState::running);  // until its owner has seen it
  bus.link.close_stream(refused);
  bus.run();
  CHECK(bus.link.state() == UsbLinkState::closed);
}

TEST_CASE("an answer to connect that makes no sense refuses the stream only") {
  Bus bus;
  const auto first = bus.open();
  bus.device.answer_connect(from_hex("070000"));
  const auto half = bus.link.open_stream();
  bus.run();
  CHECK(bus.closed_reason(half) == "USB device: stream refused: 3 bytes in the answer, expected 4");
  bus.device.answer_connect(from_hex("07000000"));
  const auto twice = bus.link.open_stream();
  bus.run();
  CHECK(bus.closed_reason(twice) == "USB device: stream refused: the device gave stream id 7, which is in use");
  CHECK(bus.link.is_open(first));
}

TEST_CASE("a stall in the middle of a transfer closes all streams, then resets the device") {
  for (const bool is_in : {true, false}) {
    Bus bus;
    const auto first = bus.open();
    const auto second = bus.open();
    bus.device.send(7, pattern(100));
    bus.run();
    if (is_in) {
      bus.device.stall_next_in();
    } else {
      bus.device.stall_next_out();
      bus.link.write(first, pattern(1000));
    }
    bus.run();
    const auto expected = std::string("USB device: ") + (is_in ? "read" : "write") + ": refused by the device (stall)";
    CHECK(bus.closed_reason(first) == expected);
    CHECK(bus.closed_reason(second) == expected);
    CHECK(bus.read_all(first) == pattern(100));  // what came before it
    CHECK(describe(bus.device.control_log().back()) == "c1 03 0000 0000 4");
    CHECK(bus.link.state() == UsbLinkState::closed);
    CHECK(bus.device.take_closed() == std::vector<std::int32_t>{7, 8});
    const auto late = bus.link.open_stream();
    bus.run();
    CHECK(bus.closed_reason(late) == "USB device: is being closed");
  }
}

TEST_CASE("unplugging with writes pending closes all streams without further requests") {
  Bus bus({.max_input = 10});
  const auto key = bus.open();
  bus.link.write(key, pattern(10'000));
  bus.run();
  REQUIRE(bus.writes.size() == 4);  // the device says NAK
  const auto requests = bus.device.control_log().size();
  bus.device.unplug();
  bus.step();
  CHECK(bus.closed_reason(key) == "USB device: write: the device is gone");
  CHECK(bus.link.state() == UsbLinkState::closed);
  CHECK(bus.device.control_log().size() == requests);
  bus.link.close_stream(key);
  CHECK_FALSE(bus.link.poll_control());
}

TEST_CASE("a sub-packet that breaks a rule is fatal for the device") {
  const std::pair<const char*, const char*> cases[] = {
      {"0900 0000 07000000", "USB sub-packet: len is 9, the transfer has 8 bytes"},
      {"0800 0000 07000000 00", "USB sub-packet: len is 8, the transfer has 9 bytes"},
      {"07", "USB sub-packet: found 1 bytes, expected 8 or more"},
      {"0a00 0100 07000000 0000", "USB sub-packet: a command, which no device may send"},
      {"0a00 0700 07000000 0000", "USB sub-packet: flags 0x0007, expected 0 or 2"},
      {"0800 0200 07000000", "USB notification: found 0 bytes, expected 2"},
  };
  for (const auto& [transfer, reason] : cases) {
    Bus bus;
    const auto key = bus.open();
    bus.device.send_raw(from_hex(transfer));
    bus.run();
    CHECK(bus.closed_reason(key) == reason);
    CHECK(bus.link.state() == UsbLinkState::closed);
  }
}

TEST_CASE("data of unknown streams, empty transfers and empty data are passed over") {
  Bus bus;
  const auto key = bus.open();
  bus.device.send_raw(from_hex("0b00 0000 63000000 010203"));
  bus.device.send_raw({});
  bus.device.send_raw(from_hex("0800 0000 07000000"));
  bus.device.notify(99, 1);
  bus.device.notify(7, 0);
  bus.device.notify(7, 55);
  bus.device.send(7, pattern(9));
  bus.run();
  CHECK(bus.link.is_open(key));
  CHECK(bus.read_all(key) == pattern(9));
}

TEST_CASE("a paused stream sends nothing until it is resumed; the others go on") {
  Bus bus;
  const auto paused = bus.open();
  const auto other = bus.open();
  bus.device.notify(7, 2);
  bus.run();
  bus.link.write(paused, pattern(100));
  bus.link.write(other, pattern(50));
  bus.run();
  CHECK(bus.device.take_input(7).empty());
  CHECK(bus.device.take_input(8) == pattern(50));
  CHECK_FALSE(bus.link.is_sent(paused));
  bus.device.notify(7, 3);
  bus.run();
  CHECK(bus.device.take_input(7) == pattern(100));
  CHECK(bus.link.is_sent(paused));
}

TEST_CASE("a device whose function is not interface 0 is asked by its number") {
  Bus bus({.interface = 3});
  const auto key = bus.open();
  bus.link.close_stream(key);
  bus.run();
  REQUIRE(bus.device.control_log().size() == 5);
  for (const auto& request : bus.device.control_log()) CHECK(request.index == 3);
}

TEST_CASE("a start that fails anywhere closes the stream with the step's name") {
  SECTION("reset refused") {
    Bus bus;
    bus.device.stall_control(3);
    const auto key = bus.link.open_stream();
    bus.run();
    CHECK(bus.closed_reason(key) == "USB device: reset: refused by the device (stall)");
    CHECK(bus.link.state() == UsbLinkState::closed);
  }
  SECTION("reset answered with another length") {
    Bus bus;
    bus.device.answer_reset(Bytes(2));
    const auto key = bus.link.open_stream();
    bus.run();
    CHECK(bus.closed_reason(key) == "USB device: reset: 2 bytes in the answer, expected 4");
  }
  SECTION("protocol refused") {
    Bus bus;
    bus.device.stall_control(6);
    const auto key = bus.link.open_stream();
    bus.run();
    CHECK(bus.closed_reason(key) == "USB device: protocol 0x0101: refused by the device (stall)");
    CHECK(bus.link.state() == UsbLinkState::closed);
  }
  SECTION("connect refused") {
    Bus bus;
    bus.device.stall_control(1);
    const auto key = bus.link.open_stream();
    bus.run();
    CHECK(bus.closed_reason(key) == "USB device: stream refused: refused by the device (stall)");
  }
  SECTION("unplugged before it began") {
    Bus bus;
    bus.device.unplug();
    const auto key = bus.link.open_stream();
    bus.run();
    CHECK(bus.closed_reason(key) == "USB device: the device is gone");
    CHECK(bus.link.state() == UsbLinkState::closed);
  }
}

TEST_CASE("a stream given up while it is being opened is closed at the device") {
  Bus bus;
  bus.open();
  const auto key = bus.link.open_stream();
  const auto request = bus.link.poll_control();
  REQUIRE(request);
  bus.link.close_stream(key);
  const auto reply = bus.device.control(*request);
  bus.link.handle_control(reply.status, reply.data);
  bus.run();
  CHECK(describe(bus.device.control_log().back()) == "41 02 0000 0000 4: 08000000");
  CHECK(bus.device.stream_count() == 1);
}

TEST_CASE("a link given up before it has started still leaves the device clean") {
  Bus bus;
  const auto key = bus.link.open_stream();
  const auto request = bus.link.poll_control();
  bus.link.close_stream(key);
  const auto reply = bus.device.control(*request);
  bus.link.handle_control(reply.status, reply.data);
  bus.run();
  CHECK(bus.link.state() == UsbLinkState::closed);
  CHECK(bus.events.empty());
}

TEST_CASE("a new stream waits until no bytes of a closed one are on their way") {
  Bus bus({.max_input = 10});
  bus.open();
  const auto blocked = bus.open();
  bus.link.write(blocked, pattern(1000));
  bus.run();
  REQUIRE_FALSE(bus.writes.empty());
  bus.link.close_stream(blocked);
  const auto next = bus.link.open_stream();
  // The device forgets the stream, but what is posted for it has not been taken yet.
  const auto close_request = bus.link.poll_control();
  REQUIRE(close_request);
  CHECK(describe(*close_request) == "41 02 0000 0000 4: 08000000");
  const auto reply = bus.device.control(*close_request);
  bus.link.handle_control(reply.status, reply.data);
  CHECK_FALSE(bus.link.poll_control());
  bus.run();
  CHECK(bus.link.is_open(next));
  CHECK(bus.device.take_input(8).empty());
}

TEST_CASE("write() takes a bounded amount and says when there is room again") {
  Bus bus({.max_input = 10}, {.max_unsent_bytes = 200});
  const auto key = bus.open();
  const auto data = pattern(1000);
  CHECK(bus.link.write(key, data) == 200);
  CHECK(bus.link.write(key, data) == 0);
  Bytes received;
  std::size_t sent = 200;
  for (int round = 0; round < 200 && received.size() < data.size(); ++round) {
    bus.events.clear();
    bus.run();
    for (const auto& event : bus.events)
      if (event.kind == UsbEventKind::writable) sent += bus.link.write(key, ByteSpan(data).subspan(sent));
    const auto taken = bus.device.take_input(7);
    received.insert(received.end(), taken.begin(), taken.end());
  }
  CHECK(received == data);
}

TEST_CASE("a stream that is not read stops the pipe for a while, then is closed for the sake of the others") {
  using namespace std::chrono_literals;
  Bus bus({}, {.max_unread_bytes = 500, .read_stall = 5s});
  const auto lazy = bus.open();
  const auto busy = bus.open();
  bus.device.send(7, pattern(2000));
  bus.run();
  CHECK(bus.link.unread_bytes(lazy) <= 500 + 5 * 56);  // nothing more was read
  CHECK(bus.device.unsent_bytes(7) > 0);
  REQUIRE(bus.link.poll_timeout() == bus.now + 5s);
  SECTION("read in time") {
    bus.now += 4s;
    Bytes received;
    while (received.size() < 2000) {
      const auto piece = bus.read_all(lazy);
      REQUIRE_FALSE(piece.empty());
      received.insert(received.end(), piece.begin(), piece.end());
      bus.run();
    }
    CHECK(received == pattern(2000));
    CHECK(bus.link.poll_timeout() == TimePoint::max());
    CHECK(bus.link.is_open(lazy));
  }
  SECTION("not read in time") {
    bus.device.send(8, pattern(77));
    bus.now += 5s;
    bus.link.handle_timeout(bus.now);
    bus.run();
    CHECK(bus.closed_reason(lazy).find("were not read in time") != std::string::npos);
    CHECK(bus.device.take_closed() == std::vector<std::int32_t>{7});
    CHECK(bus.read_all(busy) == pattern(77));
    CHECK(bus.link.poll_timeout() == TimePoint::max());
  }
}

TEST_CASE("a stream's data are announced once, until they have been read") {
  Bus bus;
  const auto key = bus.open();
  bus.events.clear();
  bus.device.send(7, pattern(300));
  bus.run();
  CHECK(bus.events.size() == 1);
  bus.read_all(key);
  bus.device.send(7, pattern(1));
  bus.run();
  REQUIRE(bus.events.size() == 2);
  CHECK(bus.events[1].kind == UsbEventKind::readable);
}

TEST_CASE("streams of one device are bounded") {
  Bus bus({.max_streams = 100}, {.max_streams = 3});
  for (int count = 0; count < 3; ++count) bus.open();
  const auto over = bus.link.open_stream();
  bus.run();
  CHECK(bus.closed_reason(over) == "USB device: has 3 streams, the limit");
  bus.link.close_stream(over);
}

TEST_CASE("closing the link ends all streams with the reason and resets the device") {
  Bus bus;
  const auto key = bus.open();
  bus.link.close(make_error(ErrorCode::connection_error, "the program ends"));
  bus.run();
  CHECK(bus.closed_reason(key) == "the program ends");
  CHECK(bus.link.state() == UsbLinkState::closed);
  CHECK(bus.device.stream_count() == 0);
}
