// The latency of an empty function call over TCP on the loopback, against a raw echo of as many bytes each way.
//
//   bench_call PORT     of a test service (test/interop/README.md)
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <string>

#include "node/client/client.hpp"
#include "test/bench/comparison.hpp"
#include "test/bench/raw_echo.hpp"
#include "test/bench/raw_session.hpp"

namespace {

void run(std::uint16_t port) {
  boost::asio::io_context io;
  rr::bench::RawSession session(io, port);
  const rr::Bytes request = session.make_call("nothing");
  const std::size_t reply_size = session.round_trip(request);
  rr::Message reply;
  session.decode_reply(reply);

  const rr::bench::RawEcho echo(request.size(), reply_size);
  auto socket = rr::bench::connect_to(io, echo.port());
  std::vector<std::uint8_t> answer(reply_size);

  const auto echo_round_trip = [&] {
    boost::asio::write(socket, boost::asio::buffer(request));
    boost::asio::read(socket, boost::asio::buffer(answer));
  };

  rr::bench::compare(
      "call, empty function, service alone", 20'000, [&] { session.round_trip(request); }, echo_round_trip);
  session.decode_reply(reply);

  const auto robot = rr::connect("rr+tcp://127.0.0.1:" + std::to_string(port) + "/?service=interop");
  rr::bench::compare(
      "call, empty function, client and service", 20'000, [&] { robot.call("nothing"); }, echo_round_trip);
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 2) {
    std::fprintf(stderr, "usage: bench_call PORT\n");
    return 2;
  }
  try {
    run(static_cast<std::uint16_t>(std::atoi(argv[1])));
  } catch (const std::exception& error) {
    std::fprintf(stderr, "bench_call: %s\n", error.what());
    return 1;
  }
}
