// The hardware transport against a real kernel and libusb: runs as root in the guest that run.py starts, beside the
// device of emulator.cpp.
#include <dirent.h>
#include <unistd.h>

#include <boost/asio/co_spawn.hpp>
#include <boost/asio/detached.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/redirect_error.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/asio/this_coro.hpp>
#include <boost/asio/use_awaitable.hpp>
#include <catch2/catch.hpp>
#include <exception>

#include "core/support/time.hpp"
#include "node/transport/hardware.hpp"
#include "test/support/print.hpp"

using namespace rr;
namespace asio = boost::asio;
using namespace std::chrono_literals;

namespace {

const ConnectionUrl by_name = parse_url("rr+usb:///?nodename=interop.service&service=x").value();

// No co_await stands within CHECK or REQUIRE: g++ 12 carries it out twice there.

DialOptions within(std::chrono::milliseconds timeout) {
  DialOptions options;
  options.timeout = timeout;
  options.send_stall = 2s;
  return options;
}

/// Runs one coroutine to its end.
struct Loop {
  asio::io_context io{1};

  void run(std::function<awaitable<void>()> body, std::chrono::seconds limit = 20s) {
    bool is_done = false;
    asio::co_spawn(
        io, [&]() -> awaitable<void> { co_await body(); },
        [&](std::exception_ptr failure) {
          is_done = true;
          io.stop();
          if (failure) std::rethrow_exception(failure);
        });
    io.restart();
    io.run_for(limit);
    REQUIRE(is_done);
  }
};

awaitable<std::unique_ptr<ByteStream>> open(std::string_view command, ConnectionUrl url = by_name) {
  auto stream = co_await dial(url, within(5s));
  REQUIRE(stream);
  const auto line = "TEST " + std::string(command) + "\n";
  const ByteSpan slice[] = {as_bytes(line)};
  const auto error = co_await (*stream)->write(slice);
  REQUIRE_FALSE(error);
  co_return std::move(*stream);
}

/// Reads until `size` bytes or the end.
awaitable<std::pair<Bytes, error_code>> read(ByteStream& stream, std::size_t size) {
  Bytes out;
  Bytes piece(16384);
  while (out.size() < size) {
    const auto result = co_await stream.read_some(std::span(piece).first(std::min(piece.size(), size - out.size())));
    out.insert(out.end(), piece.begin(), piece.begin() + static_cast<std::ptrdiff_t>(result.bytes));
    if (result.error || result.is_end()) co_return std::pair(std::move(out), result.error);
  }
  co_return std::pair(std::move(out), error_code());
}

Bytes pattern(std::size_t size, unsigned seed) {
  Bytes out(size);
  for (auto& byte : out) byte = static_cast<std::uint8_t>((seed = seed * 1103515245u + 12345u) >> 16);
  return out;
}

awaitable<void> check_echo(ByteStream& stream, std::size_t size, unsigned seed) {
  const auto data = pattern(size, seed);
  const ByteSpan slices[] = {ByteSpan(data).first(size / 3), {}, ByteSpan(data).subspan(size / 3)};
  asio::steady_timer written(stream.executor(), TimePoint::max());
  error_code write_error;
  asio::co_spawn(
      stream.executor(), [&]() -> awaitable<void> { write_error = co_await stream.write(slices); },
      [&](std::exception_ptr) { written.cancel(); });
  const auto [back, error] = co_await read(stream, size);
  CHECK_FALSE(error);
  CHECK(back == data);
  CHECK_FALSE(write_error);
}

/// The device is there again, whatever the test before has done to it.
awaitable<void> check_alive() {
  for (int attempt = 0; attempt < 50; ++attempt) {
    auto stream = co_await dial(by_name, within(2s));
    if (stream) break;
    asio::steady_timer pause(co_await asio::this_coro::executor, 100ms);
    co_await pause.async_wait(asio::use_awaitable);
  }
  const auto stream = co_await open("echo");
  co_await check_echo(*stream, 1000, 5);
}

std::size_t open_descriptors() {
  std::size_t count = 0;
  DIR* folder = ::opendir("/proc/self/fd");
  while (::readdir(folder)) ++count;
  ::closedir(folder);
  return count;
}

}  // namespace

TEST_CASE("the device is found, with its node's name and id") {
  Loop loop;
  loop.run([]() -> awaitable<void> {
    const auto found = co_await list_hardware_nodes();
    CHECK(found.problems.empty());
    const auto& nodes = found.nodes;
    REQUIRE(nodes.size() == 1);
    CHECK(nodes[0].scheme == "rr+usb");
    CHECK(nodes[0].name == "interop.service");
    CHECK(nodes[0].url == "rr+usb:///?nodeid=10203040-5060-7080-90a0-b0c0d0e0f001&service=RobotRaconteurServiceIndex");
    // By the URL as it was found.
    const auto stream = co_await open("echo", parse_url(nodes[0].url).value());
    co_await check_echo(*stream, 10, 1);
    CHECK(stream->peer().find("(1209:5252)") != std::string::npos);
  });
}

TEST_CASE("bytes go both ways whole, at sizes around those of packets") {
  Loop loop;
  loop.run([]() -> awaitable<void> {
    const auto stream = co_await open("echo");
    for (const std::size_t size : {1u, 503u, 504u, 505u, 1008u, 4096u, 300'000u}) co_await check_echo(*stream, size, 7);
  });
}

TEST_CASE("several streams share the device") {
  Loop loop;
  loop.run([&loop]() -> awaitable<void> {
    std::vector<std::unique_ptr<ByteStream>> streams;
    for (int count = 0; count < 4; ++count) streams.push_back(co_await open("echo"));
    asio::steady_timer finished(loop.io, TimePoint::max());
    std::size_t running = streams.size();
    for (std::size_t at = 0; at < streams.size(); ++at)
      asio::co_spawn(
          loop.io,
          [&streams, at]() -> awaitable<void> { return check_echo(*streams[at], 50'000, static_cast<unsigned>(at)); },
          [&](std::exception_ptr) {
            if (--running == 0) finished.cancel();
          });
    boost::system::error_code ignored;
    co_await finished.async_wait(asio::redirect_error(asio::use_awaitable, ignored));
    CHECK(running == 0);
  });
}

TEST_CASE("end() sends what was written before it closes") {
  Loop loop;
  loop.run([]() -> awaitable<void> {
    for (const std::size_t size : {1u, 5000u, 60'000u}) {
      const auto stream = co_await open("sink");
      const auto data = pattern(size, 1);
      const ByteSpan slices[] = {data};
      co_await stream->write(slices);
      co_await stream->end(no_reason);
      Bytes into(1);
      const auto result = co_await stream->read_some(into);
      CHECK(result.error == asio::error::operation_aborted);
      const auto asking = co_await open("sunk");
      const auto [count, error] = co_await read(*asking, 100);
      CHECK(as_text(count) == std::to_string(size));
    }
  });
}

TEST_CASE("a stream that the device closes ends in good order") {
  Loop loop;
  loop.run([]() -> awaitable<void> {
    const auto other = co_await open("echo");
    const auto stream = co_await open("close");
    const auto [bytes, error] = co_await read(*stream, 100);
    CHECK_FALSE(error);
    CHECK(as_text(bytes) == "bye");
    co_await check_echo(*other, 100, 1);
  });
}

TEST_CASE("cancel() ends a read and leaves the stream open") {
  Loop loop;
  loop.run([&loop]() -> awaitable<void> {
    const auto stream = co_await open("echo");
    asio::steady_timer soon(loop.io, 50ms);
    soon.async_wait([&](const error_code&) { stream->cancel(); });
    Bytes into(1);
    const auto result = co_await stream->read_some(into);
    CHECK(result.error == asio::error::operation_aborted);
    co_await check_echo(*stream, 100, 1);
  });
}

TEST_CASE("a stall ends the streams; the device can be used again at once") {
  for (const std::string command : {"stall-in", "stall-out"}) {
    Loop loop;
    loop.run([&command]() -> awaitable<void> {
      const auto other = co_await open("echo");
      const auto stream = co_await open(command);
      const auto data = pattern(100, 1);
      const ByteSpan slices[] = {data};
      co_await stream->write(slices);
      const auto [bytes, error] = co_await read(*other, 1);
      CHECK(error == asio::error::connection_reset);
      const auto after = co_await read(*stream, 1);
      CHECK(after.second == asio::error::connection_reset);
      co_await check_alive();
    });
  }
}

TEST_CASE("a sub-packet with a wrong length is a protocol error") {
  Loop loop;
  loop.run([]() -> awaitable<void> {
    const auto stream = co_await open("wrong-length");
    const auto [bytes, error] = co_await read(*stream, 1);
    CHECK(error.value() == EPROTO);
    co_await check_alive();
  });
}

TEST_CASE("unplugging with writes pending ends them; it is noticed, and so is plugging in") {
  Loop loop;
  std::vector<std::size_t> counts;
  asio::steady_timer changed(loop.io, TimePoint::max());
  const HardwareWatch watch(
      loop.io.get_executor(),
      [&](const std::vector<HardwareNode>& nodes) {
        counts.push_back(nodes.size());
        changed.cancel();
      },
      [](const std::string&) {}, 20s);
  const auto wait_for = [&](std::size_t count) -> awaitable<void> {
    error_code ignored;
    while (counts.empty() || counts.back() != count)
      co_await changed.async_wait(asio::redirect_error(asio::use_awaitable, ignored));
  };
  loop.run([&]() -> awaitable<void> {
    co_await wait_for(1);
    const auto stream = co_await open("unplug-soon");
    const auto fill = pattern(200'000, 1);
    const ByteSpan slices[] = {fill};
    const auto write_error = co_await stream->write(slices);
    CHECK(write_error == asio::error::connection_reset);
    const auto after = co_await read(*stream, 1);
    CHECK(after.second == asio::error::connection_reset);
    co_await wait_for(0);
    co_await wait_for(1);
    co_await check_alive();
  });
}

TEST_CASE("a device that takes nothing stalls the write, which ends in time") {
  Loop loop;
  loop.run([]() -> awaitable<void> {
    const auto stream = co_await open("deaf");
    const auto fill = pattern(200'000, 1);
    const ByteSpan slices[] = {fill};
    const auto error = co_await stream->write(slices);
    CHECK(error == asio::error::timed_out);
    co_await check_alive();
  });
}

TEST_CASE("a second program finds the device busy") {
  Loop first;
  Loop second;
  std::unique_ptr<ByteStream> stream;
  first.run([&]() -> awaitable<void> { stream = co_await open("echo"); });
  second.run([]() -> awaitable<void> {
    const auto refused = co_await dial(by_name, within(5s));
    REQUIRE_FALSE(refused);
    CHECK(refused.error().message.find("another program or driver uses the interface") != std::string::npos);
  });
  first.run([&]() -> awaitable<void> {
    co_await check_echo(*stream, 100, 1);
    stream.reset();
    co_await check_alive();
  });
}

TEST_CASE("a node that is not there is named together with what is") {
  Loop loop;
  loop.run([]() -> awaitable<void> {
    const auto missing = co_await dial(parse_url("rr+usb:///?nodename=other&service=x").value(), within(5s));
    REQUIRE_FALSE(missing);
    INFO(missing.error().message);
    CHECK(missing.error().message.find("rr+usb:///?nodename=other&service=x: no such node on USB; found "
                                       "'interop.service' {10203040-5060-7080-90a0-b0c0d0e0f001} at USB device") == 0);
  });
}

TEST_CASE("without permission the message names the node and the rule") {
  REQUIRE(::seteuid(65534) == 0);
  Loop loop;
  Result<std::unique_ptr<ByteStream>> refused = make_error(ErrorCode::none, "");
  loop.run([&]() -> awaitable<void> { refused = co_await dial(by_name, within(5s)); });
  REQUIRE(::seteuid(0) == 0);
  REQUIRE_FALSE(refused);
  INFO(refused.error().message);
  CHECK(refused.error().message.find("permission denied, /dev/bus/usb/") != std::string::npos);
  CHECK(refused.error().message.find("60-robotraconteur-usb.rules") != std::string::npos);
}

TEST_CASE("a loop runs out of work when the last stream is closed") {
  Loop loop;
  loop.run([]() -> awaitable<void> {
    const auto stream = co_await open("echo");
    co_await check_echo(*stream, 1000, 3);
  });
  loop.io.restart();
  loop.io.run_for(5s);
  CHECK(loop.io.stopped());
}

TEST_CASE("a loop that ends with streams open leaves no descriptor behind") {
  const auto before = open_descriptors();
  for (int round = 0; round < 3; ++round) {
    Loop loop;
    std::unique_ptr<ByteStream> stream;
    loop.run([&]() -> awaitable<void> { stream = co_await open("echo"); });
    asio::co_spawn(
        loop.io, [&]() -> awaitable<void> { co_await read(*stream, 1); }, asio::detached);
    loop.io.restart();
    loop.io.poll();
    stream.reset();
  }
  CHECK(open_descriptors() <= before);
}

// Not among the others: run.py wants it before the reference takes its turn.
TEST_CASE("a device comes back with its function on another interface", "[.][interface-0]") {
  Loop loop;
  loop.run([]() -> awaitable<void> {
    const auto stream = co_await open("interface-0");
    const auto [bytes, error] = co_await read(*stream, 1);
    CHECK(error == asio::error::connection_reset);
    co_await check_alive();
  });
}
