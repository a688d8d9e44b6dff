// The latency of an empty function call, against a raw TCP echo of as many bytes each way by a process beside the
// service, and what both sides allocate for it. Who starts it says where it runs.
//
//   bench_call NAME URL ECHO_PORT     `bench_peer service` and `bench_peer echo`; or a test service
//   (test/interop/README.md)
#include <array>
#include <boost/asio/read.hpp>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <string>

#include "node/client/client.hpp"
#include "test/bench/comparison.hpp"
#include "test/bench/raw_session.hpp"
#include "test/support/count_allocations.hpp"

namespace {

constexpr int rounds = 20'000;

struct CallSize {
  std::size_t request = 0;
  std::size_t reply = 0;
};

/// What one call takes on the socket, with the headers of WebSocket frames where there are any.
CallSize size_of_call(rr::RemoteObject& robot, bool is_websocket) {
  const auto& stats = robot.connection().asynchronous().session().connection().stats();
  const auto before = stats;
  robot.call("nothing");
  const auto request = static_cast<std::size_t>(stats.bytes_sent - before.bytes_sent);
  const auto reply = static_cast<std::size_t>(stats.bytes_received - before.bytes_received);
  const auto header_of = [](std::size_t payload) { return payload < 126 ? 2u : 4u; };  // RFC 6455, 5.2
  if (!is_websocket) return {request, reply};
  return {request + header_of(request) + 4, reply + header_of(reply)};
}

/// Where the service counts too: how many allocations a call takes on both sides together.
void count_allocations(const std::string& name, rr::RemoteObject& robot) {
  const auto count = [&] {
    return static_cast<double>(robot.get("allocations").to<std::uint64_t>().value() + rr::test::allocation_count);
  };
  count();
  const double before = count();
  for (int i = 0; i < rounds; ++i) robot.call("nothing");
  std::printf("{\"name\": \"allocations, %s\", \"each\": %.2f}\n", name.c_str(), (count() - before) / rounds);
}

void run(const std::string& name, const std::string& url, std::uint16_t echo_port) {
  auto robot = rr::connect(url);
  for (int i = 0; i < 1000; ++i) robot.call("nothing");
  const auto size = size_of_call(robot, url.starts_with("rr+ws"));

  boost::asio::io_context io;
  auto socket = rr::bench::connect_to(io, echo_port);
  const std::array<std::uint32_t, 2> sizes{static_cast<std::uint32_t>(size.request),
                                           static_cast<std::uint32_t>(size.reply)};
  boost::asio::write(socket, boost::asio::buffer(sizes));
  const std::vector<std::uint8_t> request(size.request);
  std::vector<std::uint8_t> reply(size.reply);
  rr::bench::compare(
      "call, " + name, rounds, [&] { robot.call("nothing"); },
      [&] {
        boost::asio::write(socket, boost::asio::buffer(request));
        boost::asio::read(socket, boost::asio::buffer(reply));
      });
  if (name.starts_with("rr+")) count_allocations(name, robot);
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 4) {
    std::fprintf(stderr, "usage: bench_call NAME URL ECHO_PORT\n");
    return 2;
  }
  try {
    run(argv[1], argv[2], static_cast<std::uint16_t>(std::atoi(argv[3])));
  } catch (const std::exception& error) {
    std::fprintf(stderr, "bench_call: %s\n", error.what());
    return 1;
  }
}
